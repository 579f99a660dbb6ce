//! Hats for the hats and helmets that a character has: each holds and hides hair under it while it is shown.
//!
//! Names say what is a hat, for old hair is as large; that it lies over the scalp says that it can hold hair.

use super::{
    part::{MeshPart, positions, triangles},
    skin::{Hint, cell, points, reach},
    space::Fitting,
    target::{Characters, Fitted, Target},
};
use crate::forces::contact::HairCollider;
use bevy::{math::ops::atan2, prelude::*};
use core::f32::consts::TAU;

/// The share of roots that a hat lies over.
const COVERED: f32 = 0.4;
/// How much farther from the middle a root may be than the hat there, as a share.
const WITHIN: f32 = 0.1;
/// The rim is where a hat ends this near to the head, in times its radius: farther out is a brim.
const NEAR: f32 = 1.3;
/// Directions around in which it is looked for.
const SECTORS: usize = 16;
/// How far roots are below the wall, and how far the top is above the rim, at least (m).
const CLEARANCE: f32 = 8e-3;
const HEIGHT: f32 = 0.02;

/// A hat that acts while its mesh is shown.
#[derive(Component, Clone, Debug)]
pub(super) struct Helmet {
    pub(super) mesh: Entity,
    pub(super) collider: HairCollider,
}

/// Hats act while their meshes are shown.
pub(super) fn wear_helmets(
    mut commands: Commands,
    helmets: Query<(Entity, &Helmet, &Fitted, Has<HairCollider>)>,
    meshes: Query<(), With<Mesh3d>>,
    characters: Characters,
) {
    for (entity, helmet, fitted, acts) in &helmets {
        let mesh = helmet.mesh;
        match meshes.contains(mesh) && characters.is_shown(mesh, fitted.wearer) {
            true if !acts => _ = commands.entity(entity).try_insert(helmet.collider.clone()),
            false if acts => _ = commands.entity(entity).try_remove::<HairCollider>(),
            _ => {}
        }
    }
}

/// The hats of a character whose hair has these `roots` (m, in its space), each with what it moves with and its place
/// there. Meshes that have hats of the game's own are left out.
pub(super) fn helmets(
    target: &Target,
    fitting: &Fitting,
    roots: &[Vec3],
) -> Vec<(Entity, (Helmet, Transform))> {
    let is_skin = |i: usize| fitting.skin.iter().any(|skin| skin.part == i);
    let others = target.parts.iter().enumerate().filter(|(i, _)| !is_skin(*i));
    let others = others.map(|(_, part)| part).filter(|part| Hint::of(&part.name) == Hint::Worn);
    let all = others.chain(&target.hats);
    let free = all.filter(|part| !target.own.hats.contains(&part.entity));
    free.filter_map(|part| helmet(part, fitting, roots)).collect()
}

fn helmet(
    part: &MeshPart,
    fitting: &Fitting,
    roots: &[Vec3],
) -> Option<(Entity, (Helmet, Transform))> {
    let to_hair = fitting.from_wearer * part.to_wearer;
    let (parent, place) = match &part.skin {
        None => (part.entity, to_hair.inverse()),
        Some(skin) => {
            let head = skin.head?;
            let pose = skin.poses.get(head)?;
            (skin.joints[head], (to_hair * pose.inverse()).inverse())
        }
    };
    let joints = part.joints_of_vertices();
    let is_of_head = |v: &usize| match (&part.skin, &joints) {
        (Some(skin), Some(joints)) => {
            joints.get(*v).and_then(|joint| skin.of_head.get(*joint)) == Some(&true)
        }
        _ => true,
    };
    let places = positions(&part.mesh);
    let corner = |v: usize| Some(to_hair.transform_point3(Vec3::from(*places.get(v)?)));
    let faces = triangles(&part.mesh).filter(|face| face.iter().all(is_of_head));
    let faces = faces.filter_map(|[a, b, c]| Some([corner(a)?, corner(b)?, corner(c)?]));
    let faces: Vec<_> = faces.filter(|face| face.iter().all(|p| p.is_finite())).collect();
    let (radii, rim) = fit(&faces, roots)?;
    let collider = HairCollider::inside(radii, rim).ok()?.hiding();
    let place = Transform::from_matrix(Mat4::from(place));
    (place.is_finite()).then_some((parent, (Helmet { mesh: part.entity, collider }, place)))
}

/// The half axes around the hair's origin, and the rim's height (m), of a hat of these triangles over these roots; `None`
/// where it does not lie over them.
fn fit(faces: &[[Vec3; 3]], roots: &[Vec3]) -> Option<(Vec3, f32)> {
    let points = points(faces);
    let reach = reach(&points, Vec3::ZERO);
    let is_under = |root: &&Vec3| {
        let far = root.length();
        far > 0.0 && reach[cell(**root / far)] > (1.0 - WITHIN) * far
    };
    let under = roots.iter().filter(is_under).count();
    if under as f32 <= COVERED * roots.len() as f32 {
        return None;
    }
    let radius = roots.iter().map(|root| root.xz().length()).fold(0.0, f32::max);
    let mut lowest = [f32::INFINITY; SECTORS];
    for (p, _) in points.iter().filter(|(p, _)| p.xz().length() < NEAR * radius) {
        let sector = ((atan2(p.z, p.x) / TAU + 0.5) * SECTORS as f32) as usize;
        let lowest = &mut lowest[sector.min(SECTORS - 1)];
        *lowest = lowest.min(p.y);
    }
    lowest.sort_by(f32::total_cmp);
    let rim = lowest[SECTORS / 2];
    let above = || roots.iter().filter(|root| root.y > rim);
    let along = above().fold(Vec3::splat(CLEARANCE), |most, root| most.max(root.abs()));
    let out = above().map(|root| (*root / along).length()).fold(1.0, f32::max);
    let radii = along * out + CLEARANCE;
    let is_sound = rim.is_finite() && radii.is_finite();
    is_sound.then(|| (radii.with_y(radii.y.max(rim + HEIGHT)), rim))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Roots on the upper part of a ball of 9 cm, and a larger ball above a height (m).
    fn roots() -> Vec<Vec3> {
        let up = |k: usize| {
            let y = 1.0 - 1.4 * (k as f32 + 0.5) / 400.0;
            let turn = Quat::from_rotation_y(2.4 * k as f32);
            0.09 * (turn * Vec3::new((1.0 - y * y).sqrt(), y, 0.0))
        };
        (0..400).map(up).collect()
    }

    fn shell(radius: f32, from: f32, to: f32) -> Vec<[Vec3; 3]> {
        let ball = Sphere::new(radius).mesh().uv(48, 32);
        let places = positions(&ball);
        let faces = triangles(&ball).map(|face| face.map(|v| Vec3::from(places[v]).xzy()));
        let is_there = |face: &[Vec3; 3]| face.iter().all(|p| (from..=to).contains(&p.y));
        faces.filter(is_there).collect()
    }

    #[test]
    fn a_hat_has_its_roots_under_it_and_its_rim_where_the_mesh_ends() {
        let roots = roots();
        for (radius, from) in [(0.1, 0.0), (0.1, -0.05), (0.12, 0.02)] {
            let (radii, rim) = fit(&shell(radius, from, 1.0), &roots).unwrap();
            assert!((rim - from).abs() < 0.012, "{radius} {from}: rim at {rim}");
            for root in roots.iter().filter(|root| root.y > rim) {
                assert!((*root / radii).length() < 0.96, "{radius} {from}: {root} in {radii}");
            }
            assert!(radii.max_element() < 0.11, "{radius} {from}: {radii}");
        }
        // With a brim, which is lower.
        let mut brimmed = shell(0.1, 0.02, 1.0);
        brimmed.extend(shell(0.16, -0.05, -0.02));
        let (_, rim) = fit(&brimmed, &roots).unwrap();
        assert!((rim - 0.02).abs() < 0.012, "{rim}");
    }

    #[test]
    fn bands_glasses_and_scarves_are_no_hats() {
        let roots = roots();
        assert_eq!(fit(&shell(0.1, -0.02, 0.02), &roots), None);
        assert_eq!(fit(&shell(0.1, -0.1, -0.05), &roots), None);
        assert_eq!(fit(&shell(0.05, -1.0, 1.0), &roots), None, "within the head");
        assert_eq!(fit(&[], &roots), None);
        assert_eq!(fit(&shell(0.1, 0.0, 1.0), &[]), None);
    }
}
