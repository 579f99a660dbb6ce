//! How large hair is on the screen, for its levels of detail.

use super::HairBuffers;
use crate::simulation::lod::{HairScreenShare, model::screen_share};
use bevy::{
    camera::{Camera, primitives::Aabb},
    prelude::*,
};

/// Once a frame, after hair has been packed: the largest share in any active view. Without a view the
/// value is not changed.
pub(super) fn measure(
    cameras: Query<(&Camera, &GlobalTransform)>,
    mut hairs: Query<(&HairBuffers, &GlobalTransform, &mut HairScreenShare)>,
    drawn: Query<&Aabb>,
) {
    for (buffers, place, mut share) in &mut hairs {
        let Ok(bounds) = drawn.get(buffers.drawn) else { continue };
        let center = place.transform_point(bounds.center.into());
        let scale = place.affine().matrix3.determinant().abs().cbrt();
        let radius = bounds.half_extents.length() * scale;
        let views = cameras.iter().filter(|(camera, _)| camera.is_active);
        let seen = views.map(|(camera, from)| seen_in(camera, from, center, radius));
        if let Some(largest) = seen.reduce(f32::max)
            && largest.is_finite()
        {
            share.set_if_neq(HairScreenShare(largest));
        }
    }
}

fn seen_in(camera: &Camera, from: &GlobalTransform, center: Vec3, radius: f32) -> f32 {
    let clip = camera.clip_from_view();
    let ahead = (center - from.translation()).dot(*from.forward());
    if ahead < -radius {
        return 0.0;
    }
    if clip.w_axis.w == 1.0 {
        // Orthographic: the size does not depend on the distance.
        return clip.y_axis.y * radius;
    }
    screen_share(radius, from.translation().distance(center), clip.y_axis.y)
}

/// The size of a pixel (m) where a ball is nearest; `None` where it is out of sight.
pub(super) fn pixel_in(
    camera: &Camera,
    from: &GlobalTransform,
    center: Vec3,
    radius: f32,
) -> Option<f32> {
    let height = camera.physical_viewport_size()?.y as f32;
    let clip = camera.clip_from_view();
    let ahead = (center - from.translation()).dot(*from.forward());
    let away = match clip.w_axis.w == 1.0 {
        true => 1.0,
        false => (from.translation().distance(center) - radius).max(0.0),
    };
    let pixel = 2.0 * away / (clip.y_axis.y.abs() * height);
    (ahead >= -radius && pixel.is_finite()).then_some(pixel)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hair_behind_the_camera_has_no_share() {
        let camera = Camera::default();
        let from = GlobalTransform::IDENTITY;
        assert_eq!(seen_in(&camera, &from, Vec3::Z, 0.1), 0.0);
        assert!(seen_in(&camera, &from, Vec3::NEG_Z, 0.1) > 0.0);
    }
}
