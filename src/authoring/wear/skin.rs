//! Which meshes of a head are its skin, which lie over it (old hair, a hat) and which within it (eyes, teeth).
//!
//! Seen from the middle of the head, directions are divided into cells of equal area. For each mesh and cell, how
//! far out the mesh reaches there; of two meshes that share cells, the one that is farther out in most of them
//! lies over the other. Names decide only what is nearly even.

use bevy::{math::ops::atan2, prelude::*};
use core::f32::consts::TAU;

/// Cells from bottom to top and around.
const ROWS: usize = 16;
const COLUMNS: usize = 32;
const CELLS: usize = ROWS * COLUMNS;
/// Points of each mesh.
const POINTS: f32 = 8000.0;
/// The share of its cells that a mesh has in common with another that it lies over, or within.
const SHARED: f32 = 0.5;
/// How much less, or more, is enough where the name says the same, or the contrary.
const HINT: f32 = 0.25;
/// Smallest difference of distances by which one is farther out (share of the distance).
const APART: f32 = 0.01;
/// How far below the skin an eye's joint is at most (share of its distance).
const EYE_DEPTH: f32 = 0.3;
/// Passes until the middle of the head is that of its skin.
const PASSES: usize = 3;

/// What a mesh is for the head.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// Hair may grow on it.
    Skin,
    /// It lies over the skin.
    Over,
    /// It lies within the head.
    Within,
}

/// What a name says of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Hint {
    #[default]
    None,
    Skin,
    Hair,
    Worn,
    Within,
}

impl Hint {
    /// What the name of a mesh or its material says, if anything.
    pub(super) fn of(name: &str) -> Self {
        let name = name.to_ascii_lowercase();
        let says = |words: &[&str]| words.iter().any(|word| name.contains(word));
        let hair = ["hair", "brow", "lash", "beard", "moustache", "mustache", "ponytail", "bangs"];
        let worn = ["hat", "helm", "hood", "cap", "crown", "glass", "mask", "scarf", "cloth"];
        if says(&["eye", "teeth", "tooth", "tongue", "cornea", "gum"]) && !says(&hair) {
            Self::Within
        } else if says(&hair) {
            Self::Hair
        } else if says(&["skin", "face", "head", "body", "scalp"]) {
            Self::Skin
        } else if says(&worn) {
            Self::Worn
        } else {
            Self::None
        }
    }
}

/// A mesh of the head: the triangles that move with it.
pub(super) struct Shell {
    pub(super) triangles: Vec<[Vec3; 3]>,
    pub(super) hint: Hint,
}

/// Points all over the triangles, the same for the same triangles.
pub(super) fn points(triangles: &[[Vec3; 3]]) -> Vec<(Vec3, f32)> {
    let area = |[a, b, c]: &[Vec3; 3]| 0.5 * (*b - *a).cross(*c - *a).length();
    let areas: Vec<f32> = triangles.iter().map(area).collect();
    let all: f32 = areas.iter().sum();
    let mut points = Vec::new();
    for ([a, b, c], area) in triangles.iter().zip(areas) {
        let count = (POINTS * area / all).ceil().clamp(0.0, POINTS) as usize;
        points.extend((0..count).map(|i| {
            // Roberts' sequence, folded into the triangle.
            let i = i as f32 + 0.5;
            let [u, v] = [(i * 0.754_877_7).fract(), (i * 0.569_840_3).fract()];
            let [u, v] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
            (*a + (*b - *a) * u + (*c - *a) * v, area / count as f32)
        }));
    }
    points
}

/// How far out a mesh reaches in each cell; 0 where it does not.
pub(super) fn reach(points: &[(Vec3, f32)], middle: Vec3) -> Vec<f32> {
    let mut reach = vec![0.0_f32; CELLS];
    for (p, _) in points {
        let off = *p - middle;
        let far = off.length();
        if far > 0.0 && far.is_finite() {
            let cell = &mut reach[cell(off / far)];
            *cell = cell.max(far);
        }
    }
    reach
}

pub(super) fn cell(way: Vec3) -> usize {
    let row = ((way.y * 0.5 + 0.5) * ROWS as f32) as usize;
    let column = ((atan2(way.z, way.x) / TAU + 0.5) * COLUMNS as f32) as usize;
    row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)
}

/// The role of each mesh. `eyes` are places of joints of eyes. One of them at least is skin.
pub(super) fn roles(shells: &[Shell], eyes: &[Vec3]) -> Vec<Role> {
    let mut roles = vec![Role::Skin; shells.len()];
    if shells.len() < 2 {
        return roles;
    }
    let points: Vec<_> = shells.iter().map(|shell| points(&shell.triangles)).collect();
    for _ in 0..PASSES {
        let of_skin = points.iter().zip(&roles).filter(|(_, role)| **role == Role::Skin);
        let (sum, all) = of_skin
            .flat_map(|(points, _)| points)
            .fold((Vec3::ZERO, 0.0), |(sum, all), (p, area)| (sum + *p * *area, all + area));
        let now = from_middle(shells, &points, eyes, sum / all.max(f32::MIN_POSITIVE));
        if now == roles {
            break;
        }
        roles = now;
    }
    roles
}

fn from_middle(
    shells: &[Shell],
    points: &[Vec<(Vec3, f32)>],
    eyes: &[Vec3],
    middle: Vec3,
) -> Vec<Role> {
    let reaches: Vec<_> = points.iter().map(|points| reach(points, middle)).collect();
    let covered = |reach: &[f32]| reach.iter().filter(|far| **far > 0.0).count() as f32;
    // What the eyes stick out of is not the skin.
    let holds_eyes = |reach: &[f32]| {
        eyes.iter().all(|eye| {
            let off = *eye - middle;
            let skin = reach[cell(off.normalize_or(Vec3::Y))];
            skin == 0.0 || skin > off.length() * (1.0 - 0.5 * EYE_DEPTH)
        })
    };
    let (mut roles, mut within) = (vec![Role::Skin; shells.len()], Vec::new());
    for (a, outer) in reaches.iter().enumerate() {
        for (b, inner) in reaches.iter().enumerate() {
            let (mut shared, mut over) = (0.0, 0.0);
            for (a, b) in outer.iter().zip(inner).filter(|(a, b)| **a > 0.0 && **b > 0.0) {
                shared += 1.0;
                over += f32::from(u8::from(*a > *b * (1.0 + APART)));
            }
            if a == b || over < 0.5 * shared || shared == 0.0 {
                continue;
            }
            let hint = match (shells[a].hint, shells[b].hint) {
                (Hint::Hair | Hint::Worn, _) => -HINT,
                (Hint::Skin, _) => HINT,
                _ => 0.0,
            };
            if shared >= (SHARED + hint) * covered(outer) && holds_eyes(inner) {
                roles[a] = Role::Over;
            } else if shared >= SHARED * covered(inner) {
                within.push((a, b));
            }
        }
    }
    // What lies below hair or a hat is not within the head.
    for (outer, inner) in within {
        if roles[outer] != Role::Over && roles[inner] == Role::Skin {
            roles[inner] = Role::Within;
        }
    }
    if !roles.contains(&Role::Skin) {
        // The innermost of those that go all round.
        let widest = (0..shells.len())
            .max_by(|a, b| covered(&reaches[*a]).total_cmp(&covered(&reaches[*b])).then(b.cmp(a)));
        if let Some(widest) = widest {
            roles[widest] = Role::Skin;
        }
    }
    roles
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A part of an ellipsoid of these half axes, where `is_part` holds for directions.
    fn shell(half: Vec3, at: Vec3, hint: Hint, is_part: impl Fn(Vec3) -> bool) -> Shell {
        let way = |row: usize, column: usize| {
            let (up, around) =
                (row as f32 / 24.0 * core::f32::consts::PI, column as f32 / 48.0 * TAU);
            Vec3::new(up.sin() * around.cos(), up.cos(), up.sin() * around.sin())
        };
        let quads = (0..24).flat_map(|row| (0..48).map(move |column| (row, column)));
        let triangles = quads.flat_map(|(row, column)| {
            let [a, b] = [way(row, column), way(row, column + 1)];
            let [c, d] = [way(row + 1, column), way(row + 1, column + 1)];
            [[a, b, c], [b, d, c]]
        });
        let is_in = |t: &[Vec3; 3]| is_part((t[0] + t[1] + t[2]) / 3.0);
        let placed = triangles.filter(is_in).map(|t| t.map(|p| p * half + at));
        Shell { triangles: placed.collect(), hint }
    }

    const AT: Vec3 = Vec3::new(0.2, 1.6, -0.1);
    const HEAD: Vec3 = Vec3::new(0.077, 0.118, 0.098);

    fn eye(x: f32) -> Shell {
        shell(Vec3::splat(0.012), AT + Vec3::new(x, 0.0, 0.075), Hint::None, |_| true)
    }

    #[test]
    fn hair_and_hats_lie_over_the_skin_and_eyes_within_it() {
        let face = shell(HEAD, AT, Hint::None, |_| true);
        let hair = shell(HEAD * 1.15, AT, Hint::None, |p| p.y > 0.0 || p.z < 0.0);
        let hat = shell(HEAD * Vec3::new(1.5, 2.0, 1.5), AT, Hint::None, |p| p.y > 0.2);
        let all = [hair, eye(-0.03), face, eye(0.03), hat];
        let expected = [Role::Over, Role::Within, Role::Skin, Role::Within, Role::Over];
        assert_eq!(roles(&all, &[]), expected);
    }

    #[test]
    fn all_parts_of_a_head_are_its_skin() {
        let face = shell(HEAD, AT, Hint::None, |p| p.z > 0.3);
        let scalp = shell(HEAD, AT, Hint::None, |p| p.z <= 0.3);
        let ear =
            |x: f32| shell(Vec3::new(0.01, 0.03, 0.02), AT + Vec3::X * x, Hint::None, |_| true);
        let hair = shell(HEAD * 1.1, AT, Hint::None, |p| p.y > -0.5);
        let all = [face, ear(0.083), scalp, ear(-0.083), hair, eye(0.03)];
        let found = roles(&all, &[]);
        assert_eq!([found[0], found[2]], [Role::Skin; 2], "{found:?}");
        assert_eq!([found[4], found[5]], [Role::Over, Role::Within], "{found:?}");
    }

    #[test]
    fn what_eyes_stick_out_of_is_no_skin() {
        // A skull below the skin, which a name calls head.
        let skin = shell(HEAD, AT, Hint::None, |_| true);
        let skull = shell(HEAD * 0.6, AT, Hint::Skin, |_| true);
        let eyes = [-0.03, 0.03].map(|x| AT + Vec3::new(x, 0.0, 0.082));
        assert_eq!(roles(&[skull, skin], &eyes), [Role::Within, Role::Skin]);
    }

    #[test]
    fn names_say_what_a_mesh_is() {
        for (name, hint) in [
            ("Wolf3D_Head", Hint::Skin),
            ("Face.M_Skin", Hint::Skin),
            ("Hair001", Hint::Hair),
            ("eyebrows", Hint::Hair),
            ("EyeLeft", Hint::Within),
            ("Knight_Helmet", Hint::Worn),
            ("Mesh_12", Hint::None),
        ] {
            assert_eq!(Hint::of(name), hint, "{name}");
        }
    }
}
