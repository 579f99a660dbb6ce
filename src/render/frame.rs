//! What differs from frame to frame besides nodes: how many strands are drawn, and what they are pushed
//! out of.

use super::{
    buffers::HairBuffers,
    detail::{DrawnShare, HairDetail},
    draw::Packed,
    material::RibbonMaterial,
    packed_frame::{DrawnFrame, PackedFrame},
    ribbon_mesh::{RibbonLevel, RibbonMeshes},
    rings::RoomForRings,
    screen_share::pixel_in,
    solids::{Ball, DrawnSolid, arrange, gather},
    view::HairView,
    volume::{self, BrightLights, HairVolume},
};
use crate::{
    base::setting::Settings,
    forces::contact::{HairCollider, Obstacles},
    hair::look::HairLook,
};
use bevy::{
    asset::RenderAssetUsages,
    camera::{primitives::Aabb, visibility::RenderLayers},
    prelude::*,
    render::storage::ShaderBuffer,
};

/// After strands have been packed: chooses how many are drawn, and gathers the solids near them.
pub(super) fn prepare(
    mut hairs: Query<(
        Entity,
        &mut HairBuffers,
        &mut Packed,
        &GlobalTransform,
        &mut DrawnFrame,
        Option<&Obstacles>,
    )>,
    mut drawn: Query<(&mut Mesh3d, &Aabb, &MeshMaterial3d<RibbonMaterial>, Option<&RenderLayers>)>,
    colliders: Query<(Entity, &HairCollider, &GlobalTransform)>,
    (looks, views, details): (Settings<HairLook>, Settings<HairView>, Settings<HairDetail>),
    cameras: Query<(&Camera, &GlobalTransform, Option<&RenderLayers>)>,
    (mut known, mut meshes): (ResMut<RibbonMeshes>, ResMut<Assets<Mesh>>),
    (mut shader_buffers, mut images, mut materials): (
        ResMut<Assets<ShaderBuffer>>,
        ResMut<Assets<Image>>,
        ResMut<Assets<RibbonMaterial>>,
    ),
    room: RoomForRings,
    lights: BrightLights,
    (mut balls, mut solids): (Local<Vec<Ball>>, Local<Vec<DrawnSolid>>),
) {
    balls.clear();
    balls
        .extend(colliders.iter().filter_map(|(entity, of, place)| Ball::around(entity, of, place)));
    // The largest first: they block light, and stay where there are too many.
    balls.sort_by(|a, b| b.radius.total_cmp(&a.radius));
    for (hair, mut buffers, mut packed, place, mut frame, obstacles) in &mut hairs {
        let frame = frame.bypass_change_detection();
        let packed = packed.bypass_change_detection();
        let Ok((mut mesh, around, material, layers)) = drawn.get_mut(buffers.drawn) else {
            continue;
        };
        let hair_place = place.affine();
        let inside = (Vec3::from(around.center), Vec3::from(around.half_extents));
        let scale = hair_place.matrix3.determinant().abs().cbrt();
        let center = place.transform_point(inside.0);
        let layers = layers.unwrap_or_default();
        let seen = cameras.iter().filter(|(camera, _, of)| {
            camera.is_active && of.unwrap_or_default().intersects(layers)
        });
        let mut lit_by = RenderLayers::none();
        let pixels = seen.filter_map(|(camera, from, of)| {
            lit_by = lit_by.union(of.unwrap_or_default());
            pixel_in(camera, from, center, inside.1.length() * scale)
        });
        frame.pixel = pixels.reduce(f32::min).map(|finest| finest / scale).or(frame.pixel);
        let count = buffers.strand_count;
        let share = match views.of(hair) {
            HairView::Guides => DrawnShare::ALL,
            _ => DrawnShare::new(&details.of(hair), count, looks.of(hair).width, frame.pixel),
        };
        let level = RibbonLevel::holding(count, packed.segments(), share.share, frame.level);
        frame.level = level.level();
        let wanted = known.get(level, &mut meshes);
        if mesh.0 != wanted {
            mesh.0 = wanted;
        }
        // Numbers and buffer change in one material, so that no frame has those of different levels.
        let rings = room.of(level);
        let counts = rings.ranks > 0 && packed.key.is_lit();
        let side = if counts { HairVolume::side(frame.level) } else { 0 };
        let known_side = packed.volume.as_ref().map_or(0, |(_, side)| *side);
        if packed.rings != rings || known_side != side {
            packed.rings = rings;
            packed.ribbon = packed.ribbon.with_rings(rings);
            let made = rings.size().map(|size| {
                shader_buffers.add(ShaderBuffer::with_size(size, RenderAssetUsages::default()))
            });
            packed.key.expanded = made.is_some();
            if known_side != side {
                packed.volume = (side > 0).then(|| (images.add(volume::image(side)), side));
            }
            if let Some(mut material) = materials.get_mut(&material.0) {
                (material.key, material.ribbon) = (packed.key, packed.ribbon);
                material.rings = made.clone().unwrap_or_else(|| buffers.nodes.clone());
                material.volume = packed.volume.as_ref().map(|(image, _)| image.clone());
            }
            buffers.rings = made;
        }

        frame.packed = PackedFrame::new(share);
        let from_world = hair_place.inverse();
        frame.volume = HairVolume::around(inside.0, inside.1, side, frame.volume);
        let nearest = lights.at(center, inside.1.length() * scale, &lit_by);
        frame.packed.set_volume(frame.volume, nearest, &from_world);
        solids.clear();
        gather(&mut solids, &balls, inside, place, &colliders, obstacles);
        arrange(&mut solids);
        frame.packed.set_solids(&solids);
        // New buffers are uploaded with their contents.
        if buffers.is_changed()
            && let Some(mut buffer) = shader_buffers.get_mut(&buffers.frame)
        {
            buffer.data = Some(bytemuck::bytes_of(&frame.packed).to_vec());
        }
    }
}
