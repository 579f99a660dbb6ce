//! Keeps the draw that finds out which strands are seen like the one that lights them.

use super::material::{Depth, RibbonMaterial};
use bevy::{
    camera::{
        primitives::Aabb,
        visibility::{NoAutoAabb, NoFrustumCulling, RenderLayers, VisibilityRange},
    },
    prelude::*,
};

/// On drawn hair: the child that draws its depth.
#[derive(Component, Clone, Copy, Debug)]
#[component(clone_behavior = Ignore)]
pub(super) struct DepthDraw(Entity);

type Lit = (
    Entity,
    &'static Mesh3d,
    &'static Aabb,
    &'static MeshMaterial3d<RibbonMaterial>,
    &'static GlobalTransform,
    Option<&'static DepthDraw>,
    Visible,
);

/// What decides which cameras see an entity, beside its box. That of a child must be its parent's, or strands would be
/// seen by one draw only.
type Visible =
    (Option<&'static RenderLayers>, Option<&'static VisibilityRange>, Has<NoFrustumCulling>);

type Drawn = (
    &'static mut Mesh3d,
    &'static mut Aabb,
    &'static MeshMaterial3d<RibbonMaterial<Depth>>,
    Visible,
);

/// After the lit draw has got mesh, box and material of this frame.
pub(super) fn follow(
    mut commands: Commands,
    lit: Query<Lit>,
    mut drawn: Query<Drawn, Without<MeshMaterial3d<RibbonMaterial>>>,
    materials: Res<Assets<RibbonMaterial>>,
    mut depths: ResMut<Assets<RibbonMaterial<Depth>>>,
) {
    for (entity, mesh, bounds, material, place, depth, visible) in &lit {
        let Some(material) = materials.get(&material.0) else { continue };
        let known = depth.and_then(|depth| Some((depth.0, drawn.get_mut(depth.0).ok()?)));
        let Some((depth, (mut own_mesh, mut own_bounds, own_material, own_visible))) = known else {
            let parts = (mesh.clone(), *bounds, MeshMaterial3d(depths.add(material.depth())));
            // Transforms have been propagated already in this frame.
            let name = Name::new("depth of drawn hair");
            let depth = commands.spawn((name, parts, NoAutoAabb, *place, ChildOf(entity))).id();
            commands.entity(entity).try_insert(DepthDraw(depth));
            see(&mut commands, depth, visible);
            continue;
        };
        own_mesh.set_if_neq(mesh.clone());
        own_bounds.set_if_neq(*bounds);
        if depths.get(&own_material.0).is_none_or(|own| !own.draws(material)) {
            // It is there: its handle is.
            let _ = depths.insert(&own_material.0, material.depth());
        }
        if own_visible != visible {
            see(&mut commands, depth, visible);
        }
    }
}

fn see(
    commands: &mut Commands,
    depth: Entity,
    (layers, range, always): (Option<&RenderLayers>, Option<&VisibilityRange>, bool),
) {
    let mut depth = commands.entity(depth);
    match layers {
        Some(layers) => depth.try_insert(layers.clone()),
        None => depth.try_remove::<RenderLayers>(),
    };
    match range {
        Some(range) => depth.try_insert(range.clone()),
        None => depth.try_remove::<VisibilityRange>(),
    };
    match always {
        true => depth.try_insert(NoFrustumCulling),
        false => depth.try_remove::<NoFrustumCulling>(),
    };
}
