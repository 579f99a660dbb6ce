//! The lights towards which fibres are counted.

use bevy::{
    camera::visibility::RenderLayers, ecs::system::SystemParam, light::RectLight, prelude::*,
};

/// How many for each hair; the others' light goes through a plane layer.
pub(crate) const LIGHTS: usize = 4;

/// The lights that shine.
#[derive(SystemParam)]
pub(crate) struct BrightLights<'w, 's> {
    suns: Query<'w, 's, (&'static DirectionalLight, Seen<'static>)>,
    spots: Query<'w, 's, (&'static SpotLight, Seen<'static>)>,
    points: Query<'w, 's, (&'static PointLight, Seen<'static>)>,
    panels: Query<'w, 's, (&'static RectLight, Seen<'static>)>,
}

type Seen<'a> = (&'a GlobalTransform, &'a InheritedVisibility, Option<&'a RenderLayers>);

/// A light and how strongly it shines on a hair (lx).
#[derive(Clone, Copy, Debug, Default)]
struct Bright {
    /// Its place and 1, or the way to it and 0.
    place: Vec4,
    lux: f32,
}

impl BrightLights<'_, '_> {
    /// The brightest ones for a hair within `radius` of `center`, of those that shine in pictures of these layers, in
    /// the world's frame: their place and 1, or the way to them and 0. As many as there are, the rest is zero.
    pub(crate) fn at(&self, center: Vec3, radius: f32, layers: &RenderLayers) -> [Vec4; LIGHTS] {
        // Bevy asks for the layers of a camera, not of what it sees.
        let shines = |of: Seen| of.1.get() && of.2.unwrap_or_default().intersects(layers);
        let local = |of: Seen, intensity, range| {
            let from = of.0.translation();
            let away = from.distance(center);
            let reaches = shines(of) && away - radius < range;
            let lux = if reaches { intensity / (away * away).max(1e-4) } else { 0.0 };
            Bright { place: from.extend(1.0), lux }
        };
        let suns = self.suns.iter().map(|(sun, of)| Bright {
            place: Vec3::from(of.0.back()).extend(0.0),
            lux: if shines(of) { sun.illuminance } else { 0.0 },
        });
        let spots = self.spots.iter().filter(|(spot, (place, ..))| {
            // Its cone touches the ball around the hair.
            let way = center - place.translation();
            let wide = (radius / way.length().max(1e-6)).min(1.0).asin();
            way.angle_between(place.forward().into()) < spot.outer_angle + wide
        });
        let spots = spots.map(|(spot, of)| local(of, spot.intensity, spot.range));
        let points = self.points.iter().map(|(light, of)| local(of, light.intensity, light.range));
        // Bevy 0.19 asks for no layers of these.
        let panels = self.panels.iter().map(|(light, (place, seen, _))| {
            local((place, seen, Some(layers)), light.intensity, light.range)
        });

        let mut brightest = [Bright::default(); LIGHTS];
        for light in suns.chain(spots).chain(points).chain(panels) {
            // Of lights that shine alike the first stays first.
            let Some(rank) = brightest.iter().position(|other| light.lux > other.lux) else {
                continue;
            };
            if light.place.is_finite() {
                brightest[rank..].rotate_right(1);
                brightest[rank] = light;
            }
        }
        brightest.map(|light| light.place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::ecs::system::RunSystemOnce;

    fn brightest(world: &mut World) -> [Vec4; LIGHTS] {
        world
            .run_system_once(|lights: BrightLights| {
                lights.at(Vec3::ZERO, 0.1, &RenderLayers::layer(0))
            })
            .unwrap()
    }

    #[test]
    fn the_brightest_lights_that_reach_the_hair_are_taken() {
        let mut world = World::new();
        let point = |intensity: f32| PointLight { intensity, range: 20.0, ..default() };
        let at = |x: f32| GlobalTransform::from_xyz(x, 0.0, 0.0);
        let seen = InheritedVisibility::VISIBLE;
        world.spawn((point(1000.0), at(2.0), seen));
        world.spawn((point(1000.0), at(1.0), seen));
        world.spawn((point(1e9), at(30.0), seen));
        world.spawn((point(1e9), at(1.5), InheritedVisibility::HIDDEN));
        world.spawn((point(1e9), at(1.5), seen, RenderLayers::layer(1)));
        let spot = SpotLight { intensity: 1e6, range: 20.0, outer_angle: 0.3, ..default() };
        let looking = |target: Vec3| {
            GlobalTransform::from(Transform::from_xyz(0.0, 3.0, 0.0).looking_at(target, Vec3::X))
        };
        world.spawn((spot, looking(Vec3::ZERO), seen));
        world.spawn((spot, looking(Vec3::Y * 6.0), seen));
        let sun = DirectionalLight { illuminance: 10.0, ..default() };
        world.spawn((sun, looking(Vec3::ZERO), seen));
        let found = brightest(&mut world);
        assert_eq!(found[0], Vec4::new(0.0, 3.0, 0.0, 1.0), "the spot, 1e6 / 9");
        assert_eq!(found[1], Vec4::new(1.0, 0.0, 0.0, 1.0));
        assert_eq!(found[2], Vec4::new(2.0, 0.0, 0.0, 1.0));
        assert!(found[3].distance(Vec4::Y) < 1e-6, "the way to the sun");
    }

    #[test]
    fn broken_lights_are_left_out() {
        let mut world = World::new();
        let seen = InheritedVisibility::VISIBLE;
        world.spawn((
            PointLight { intensity: f32::NAN, ..default() },
            GlobalTransform::IDENTITY,
            seen,
        ));
        let nowhere = GlobalTransform::from_translation(Vec3::NAN);
        world.spawn((PointLight::default(), nowhere, seen));
        assert_eq!(brightest(&mut world), [Vec4::ZERO; LIGHTS]);
    }
}
