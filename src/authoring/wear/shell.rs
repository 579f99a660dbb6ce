//! The shell that shades skin under hair: a copy of the skin's triangles, a hair's breadth above them, as opaque as hair
//! grows densely there. A pure function, for any thread.

use super::part::{positions, triangles};
use crate::{
    authoring::plant::RootOnMesh,
    base::grid::{KdTree, UniformGrid},
    render::FollowerRoots,
};
use bevy::{
    asset::RenderAssetUsages,
    math::Affine3A,
    mesh::{Indices, MeshVertexAttribute, PrimitiveTopology, VertexAttributeValues as Values},
    prelude::*,
};

/// How far above the skin it is, in the hair's frame (m).
const ABOVE: f32 = 0.2e-3;
/// Roots that are nearer than this to a place shade it (m), and more than these in any case.
const NEAR: f32 = 7e-3;
const AMONG: usize = 8;
/// Share of the usual density at roots at which skin is shaded in full.
const FULL: f32 = 0.75;
/// Opacity below which it is not drawn.
const LEAST: f32 = 0.004;
/// Roots of which the usual density and distance are medians.
const SAMPLES: usize = 400;

/// A mesh that hair grows on.
pub(super) struct Skin {
    pub(super) entity: Entity,
    pub(super) mesh: Mesh,
    pub(super) to_hair: Affine3A,
}

/// What covers one of them.
#[derive(Clone)]
pub(super) struct Shell {
    pub(super) skin: Entity,
    /// From the mesh to the hair.
    pub(super) place: Affine3A,
    /// Vertex colours are white, as opaque as hair is dense.
    pub(super) mesh: Mesh,
    pub(super) made_of: MadeOf,
}

/// Which part of a skin's mesh a shell is.
#[derive(Reflect, Clone, Debug, Default)]
#[reflect(Default, Clone)]
pub(super) struct MadeOf {
    /// The vertex of the skin of each of its own.
    vertices: Vec<u32>,
    /// How far above it they are, in the mesh's units.
    above: f32,
}

impl MadeOf {
    /// Its own of values for each vertex of the skin; `None` where these are too few.
    pub(super) fn pick<T: Copy>(&self, all: &[T]) -> Option<Vec<T>> {
        self.vertices.iter().map(|v| all.get(*v as usize).copied()).collect()
    }

    /// Positions and normals over a skin; `None` where it has too few.
    pub(super) fn over(&self, skin: &Mesh) -> Option<[Vec<[f32; 3]>; 2]> {
        let (places, normals) = (
            self.pick(vectors(skin, Mesh::ATTRIBUTE_POSITION)?)?,
            vectors(skin, Mesh::ATTRIBUTE_NORMAL)?,
        );
        let normals = self.pick(normals)?;
        let above = |(place, normal): (&[f32; 3], &[f32; 3])| {
            (Vec3::from(*place) + Vec3::from(*normal).normalize_or_zero() * self.above).to_array()
        };
        Some([places.iter().zip(&normals).map(above).collect(), normals])
    }
}

fn vectors(mesh: &Mesh, which: MeshVertexAttribute) -> Option<&[[f32; 3]]> {
    match mesh.try_attribute_option(which) {
        Ok(Some(Values::Float32x3(values))) => Some(values),
        _ => None,
    }
}

/// How densely hair grows around places.
struct Density {
    /// Place, normal and width of each root.
    roots: Vec<(Vec3, Vec3, f32)>,
    grid: UniformGrid,
    near: f32,
    /// At roots, as a median.
    usual: f32,
}

impl Density {
    /// With the normal of the nearest `vertex` for each root.
    fn new(roots: &[(Vec3, f32)], vertices: &[(Vec3, Vec3)]) -> Self {
        let tree = KdTree::new(vertices.iter().map(|(place, _)| *place).zip(0u32..));
        let with_normal = |(place, width): &(Vec3, f32)| {
            let (v, _) = tree.nearest::<1>(*place).next()?;
            Some((*place, vertices[v as usize].1, *width))
        };
        let roots: Vec<_> = roots.iter().filter_map(with_normal).collect();
        let tree = KdTree::new(roots.iter().map(|root| root.0).zip(0u32..));
        let samples = || roots.iter().step_by(roots.len().div_ceil(SAMPLES).max(1));
        let reach =
            |root: &(Vec3, Vec3, f32)| tree.nearest::<AMONG>(root.0).last().map(|(_, s)| s.sqrt());
        let near = NEAR.max(1.2 * median(samples().filter_map(reach)));
        let mut grid = UniformGrid::default();
        grid.build(near, roots.iter().map(|root| root.0).zip(0u32..));
        let mut density = Self { roots: Vec::new(), grid, near, usual: 0.0 };
        let sampled: Vec<_> = samples().copied().collect();
        density.roots = roots;
        density.usual =
            median(sampled.iter().map(|(place, normal, _)| density.at(*place, *normal)));
        density
    }

    /// At a place of the skin; roots on what faces elsewhere, as the inside of a lip, do not count.
    fn at(&self, place: Vec3, normal: Vec3) -> f32 {
        let mut sum = 0.0;
        self.grid.for_each_near(place, |i| {
            let (root, facing, width) = self.roots[i as usize];
            let share = 1.0 - place.distance_squared(root) / (self.near * self.near);
            if share > 0.0 {
                sum += share * share * width * facing.dot(normal).max(0.0);
            }
        });
        sum
    }

    fn opacity(&self, place: Vec3, normal: Vec3) -> f32 {
        let share = (self.at(place, normal) / (FULL * self.usual).max(f32::MIN_POSITIVE)).min(1.0);
        share * share * (3.0 - 2.0 * share)
    }
}

fn median(values: impl Iterator<Item = f32>) -> f32 {
    let mut values: Vec<f32> = values.collect();
    values.sort_by(f32::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Roots of drawn strands in the hair's frame, with their widths; of guides, for hair whose followers have none of their
/// own.
pub(super) fn drawn(
    followers: &FollowerRoots,
    roots: &[RootOnMesh],
    skins: &[Skin],
) -> Vec<(Vec3, f32)> {
    if !followers.0.is_empty() {
        return followers.0.iter().map(|f| (f.place, f.width)).collect();
    }
    let places: Vec<Vec3> = skins
        .iter()
        .flat_map(|skin| {
            let own = positions(&skin.mesh).iter();
            own.map(|place| skin.to_hair.transform_point3(Vec3::from(*place)))
        })
        .collect();
    let place = |root: &RootOnMesh| {
        let [a, b, c] = root.vertices.map(|v| places.get(v as usize).copied());
        let [u, v, w] = root.weights.to_array();
        Some((a? * u + b? * v + c? * w, 1.0))
    };
    roots.iter().filter_map(place).collect()
}

/// The shells over the skins, given place and width of each drawn strand's root in the hair's frame. None over skins
/// without hair or without normals.
pub(super) fn shells(skins: &[Skin], roots: &[(Vec3, f32)]) -> Vec<Shell> {
    let in_hair = |skin: &Skin| -> Vec<(Vec3, Vec3)> {
        let turn = skin.to_hair.matrix3.inverse().transpose();
        let normals = vectors(&skin.mesh, Mesh::ATTRIBUTE_NORMAL).unwrap_or_default();
        let each = positions(&skin.mesh).iter().zip(normals);
        let vertex = |(place, normal): (&[f32; 3], &[f32; 3])| {
            let normal = (turn * Vec3::from(*normal)).normalize_or_zero();
            (skin.to_hair.transform_point3(Vec3::from(*place)), normal)
        };
        each.map(vertex).collect()
    };
    let vertices: Vec<_> = skins.iter().map(in_hair).collect();
    let density = Density::new(roots, &vertices.concat());
    let shell = |(skin, vertices): (&Skin, &Vec<(Vec3, Vec3)>)| {
        let opacities = vertices.iter().map(|(place, normal)| density.opacity(*place, *normal));
        shell(skin, &opacities.collect::<Vec<_>>())
    };
    skins.iter().zip(&vertices).filter_map(shell).collect()
}

fn shell(skin: &Skin, opacities: &[f32]) -> Option<Shell> {
    let scale = skin.to_hair.matrix3.determinant().abs().cbrt();
    let mut made_of = MadeOf { vertices: Vec::new(), above: ABOVE / scale };
    let mut number = vec![u32::MAX; opacities.len()];
    let mut indices = Vec::new();
    let is_seen = |triangle: &[usize; 3]| {
        let [a, b, c] = triangle.map(|v| opacities.get(v).copied().unwrap_or(f32::NAN));
        a + b + c > LEAST
    };
    for v in triangles(&skin.mesh).filter(is_seen).flatten() {
        if number[v] == u32::MAX {
            number[v] = made_of.vertices.len() as u32;
            made_of.vertices.push(v as u32);
        }
        indices.push(number[v]);
    }
    if indices.is_empty() {
        return None;
    }
    let [places, normals] = made_of.over(&skin.mesh)?;
    let colors: Vec<_> = made_of.pick(opacities)?.into_iter().map(|a| [1.0, 1.0, 1.0, a]).collect();
    let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, places)
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals)
        .with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, colors)
        .with_inserted_indices(Indices::U32(indices));
    let own = |which| skin.mesh.attribute(which);
    if let (Some(Values::Uint16x4(joints)), Some(Values::Float32x4(weights))) =
        (own(Mesh::ATTRIBUTE_JOINT_INDEX), own(Mesh::ATTRIBUTE_JOINT_WEIGHT))
    {
        mesh.insert_attribute(Mesh::ATTRIBUTE_JOINT_INDEX, Values::Uint16x4(made_of.pick(joints)?));
        mesh.insert_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, made_of.pick(weights)?);
    }
    Some(Shell { skin: skin.entity, place: skin.to_hair, mesh, made_of })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball with roots on its upper half, or under the upper half of a smaller ball that faces inward.
    fn on_ball(roots: impl Fn(Vec3) -> bool) -> (Skin, Vec<(Vec3, f32)>) {
        let mesh = Sphere::new(0.1).mesh().ico(30).unwrap();
        let skin = Skin { entity: Entity::PLACEHOLDER, mesh, to_hair: Affine3A::IDENTITY };
        let golden = core::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
        let all = (0..20_000).map(|i| {
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / 20_000.0;
            let (sine, cosine) = (golden * i as f32).sin_cos();
            Vec3::new(cosine, 0.0, sine) * (1.0 - y * y).sqrt() + Vec3::Y * y
        });
        (skin, all.filter(|way| roots(*way)).map(|way| (way * 0.0997, 1.0)).collect())
    }

    fn opacity(shell: &Shell, way: Vec3) -> f32 {
        let Some(Values::Float32x4(colors)) = shell.mesh.attribute(Mesh::ATTRIBUTE_COLOR) else {
            panic!()
        };
        let near = |p: &[f32; 3]| Vec3::from(*p).normalize().distance(way) < 0.04;
        let all = positions(&shell.mesh).iter().zip(colors).filter(|(p, _)| near(p));
        all.map(|(_, color)| color[3]).fold(0.0, f32::max)
    }

    #[test]
    fn a_shell_is_opaque_among_roots_and_ends_a_few_millimetres_beyond() {
        let (skin, roots) = on_ball(|way| way.y > 0.0);
        let shell = &shells(&[skin], &roots)[0];
        assert!(opacity(shell, Vec3::Y) > 0.95 && opacity(shell, Vec3::new(0.9, 0.43, 0.0)) > 0.95);
        let low = positions(&shell.mesh).iter().map(|p| p[1]).fold(0.0, f32::min);
        assert!((-0.018..-0.002).contains(&low), "{low}");
        assert_eq!(opacity(shell, -Vec3::Y), 0.0);
        let off = positions(&shell.mesh).iter().map(|p| Vec3::from(*p).length() - 0.1 - ABOVE);
        assert!(off.map(f32::abs).fold(0.0, f32::max) < 1e-6);
    }

    #[test]
    fn few_roots_shade_as_evenly_as_many() {
        let (skin, roots) = on_ball(|way| way.y > 0.0);
        let few: Vec<_> = roots.into_iter().step_by(80).collect();
        let shell = &shells(&[skin], &few)[0];
        let least = [0.4, 0.6, 0.8, 0.95]
            .map(|y: f32| opacity(shell, Vec3::new((1.0 - y * y).sqrt(), y, 0.0)));
        assert!(least.into_iter().all(|a| a > 0.5), "{least:?}");
    }

    #[test]
    fn what_faces_away_from_the_hair_is_not_shaded() {
        let (skin, roots) = on_ball(|way| way.y > 0.0);
        let mut inner = Sphere::new(0.098).mesh().ico(30).unwrap();
        if let Some(Values::Float32x3(normals)) = inner.attribute_mut(Mesh::ATTRIBUTE_NORMAL) {
            normals.iter_mut().flatten().for_each(|n| *n = -*n);
        }
        let inner = Skin {
            entity: Entity::from_raw_u32(7).unwrap(),
            mesh: inner,
            to_hair: Affine3A::IDENTITY,
        };
        let found = shells(&[skin, inner], &roots);
        assert_eq!(found.iter().map(|shell| shell.skin).collect::<Vec<_>>(), [Entity::PLACEHOLDER]);
    }
}
