//! Lines over the scene.

use super::{HairGizmos, Owner, Owners, shapes};
use crate::{
    base::{
        setting::Ranged,
        stretch::{Stretched, acting},
    },
    forces::{
        contact::{HairCollider, LockNeighbours},
        environment::{Blower, WindZone, ZoneShape},
    },
    hair::strand::{Hair, Pose, Strand, StrandHistory, StrandOf, StrandSleep},
    keratin::treatment::PermRod,
    simulation::lod::{Follower, Guides},
    water::WaterVolume,
};
use bevy::{prelude::*, transform::TransformSystems};

/// Draws hair and what acts on it as lines, by Bevy's gizmos: see [`HairGizmos`] for what and in which
/// colours. Needs Bevy's `GizmoPlugin` and `GizmoRenderPlugin` (features `bevy_gizmos` and
/// `bevy_gizmos_render`, in `DefaultPlugins`); without them it does nothing. Disabled, it costs nothing:
///
/// ```
/// # use bevy::prelude::*; use bevy_keratin::debug::HairGizmos;
/// fn toggle(keys: Res<ButtonInput<KeyCode>>, mut store: ResMut<GizmoConfigStore>) {
///     if keys.just_pressed(KeyCode::F3) {
///         let (config, gizmos) = store.config_mut::<HairGizmos>();
///         config.enabled = !config.enabled;
///         config.depth_bias = -1.0; // in front of everything
///         gizmos.contacts = None;
///     }
/// }
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct HairDebugPlugin;

impl HairGizmos {
    fn strand(&self, owner: Owner) -> Option<Color> {
        match owner {
            Owner::Simulated => self.simulated,
            Owner::Asleep => self.asleep,
            Owner::Follower => self.followers,
            Owner::Frozen => self.frozen,
            Owner::Gpu => self.gpu,
            Owner::Settling => self.settling,
        }
    }
}

impl Plugin for HairDebugPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<HairGizmos>();
    }

    /// The gizmos' own plugin may be added after this one.
    fn finish(&self, app: &mut App) {
        if app.world().contains_resource::<Assets<GizmoAsset>>() {
            app.init_gizmo_group::<HairGizmos>().add_systems(
                PostUpdate,
                (draw_strands, draw_guides, draw_contacts, draw_surroundings)
                    .run_if(|store: Res<GizmoConfigStore>| store.config::<HairGizmos>().0.enabled)
                    .after(TransformSystems::Propagate),
            );
        }
    }
}

/// Half the length of the lines that mark a blower's wind (m).
const BLOWN: f32 = 0.3;

/// Velocities are drawn as long as the way in so many seconds.
const SECONDS: f32 = 0.1;

fn draw_strands(
    strands: Query<(&Strand, &StrandHistory, &StrandOf, &StrandSleep)>,
    hairs: Query<&GlobalTransform, With<Hair>>,
    owners: Owners,
    time: Option<Res<Time<Fixed>>>,
    mut gizmos: Gizmos<HairGizmos>,
) {
    let overstep = time.map_or(1.0, |time| time.overstep_fraction().clamp(0.0, 1.0));
    for (strand, history, of, sleep) in &strands {
        if let Some(color) = gizmos.config_ext.strand(owners.of(of, sleep))
            && let Some(pose) = hairs.get(of.0).ok().and_then(Pose::of)
            && strand.is_finite()
        {
            let place = |i| pose.point_out(history.drawn(strand, i, overstep));
            gizmos.linestrip((0..strand.nodes()).map(place), color);
        }
    }
}

fn draw_guides(
    followers: Query<(&Strand, &Follower, &StrandOf, &StrandSleep)>,
    hairs: Query<(&GlobalTransform, &Guides), With<Hair>>,
    strands: Query<&Strand>,
    mut gizmos: Gizmos<HairGizmos>,
) {
    let Some(color) = gizmos.config_ext.guides else { return };
    let root = |pose: &Pose, strand: &Strand| {
        strand.positions().first().map(|p| pose.point_out(*p)).filter(|p| p.is_finite())
    };
    for (strand, follower, of, sleep) in &followers {
        if sleep.is_follower()
            && let Ok((at, guides)) = hairs.get(of.0)
            && let Some(pose) = Pose::of(at)
            && let Some(from) = root(&pose, strand)
        {
            for guide in strands.iter_many(guides.of(follower)) {
                if let Some(to) = root(&pose, guide) {
                    gizmos.line(from, to, color);
                }
            }
        }
    }
}

fn draw_contacts(
    hairs: Query<(&GlobalTransform, &LockNeighbours), With<Hair>>,
    mut gizmos: Gizmos<HairGizmos>,
) {
    let Some(color) = gizmos.config_ext.contacts else { return };
    for (at, neighbours) in &hairs {
        let Some(pose) = Pose::of(at) else { continue };
        for (a, b) in neighbours.touching() {
            gizmos.line(pose.point_out(a), pose.point_out(b), color);
        }
    }
}

fn draw_surroundings(
    colliders: Query<(&GlobalTransform, &HairCollider)>,
    zones: Query<(&GlobalTransform, &WindZone)>,
    blowers: Query<(&GlobalTransform, &Blower)>,
    rods: Query<(&GlobalTransform, &PermRod)>,
    volumes: Query<(&GlobalTransform, &WaterVolume)>,
    mut gizmos: Gizmos<HairGizmos>,
) {
    let with = gizmos.config_ext.clone();
    for (color, pose, collider) in stretched(with.colliders, &colliders) {
        shapes::collider(&mut gizmos, &pose, &collider, color);
    }
    for (color, pose, zone) in stretched(with.wind_zones, &zones) {
        shapes::zone(&mut gizmos, &pose, zone.shape, zone.half_size, color);
        let (end, faint) = (zone.half_size + zone.falloff / pose.scale, color.with_alpha(0.3));
        if zone.falloff > 0.0 && zone.shape != ZoneShape::HalfSpace {
            shapes::zone(&mut gizmos, &pose, zone.shape, end, faint);
        }
        let center = pose.translation;
        if zone.velocity != Vec3::ZERO {
            gizmos.arrow(center, center + pose.rotation * zone.velocity * SECONDS, color);
        }
        if zone.outward != 0.0 {
            for way in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
                let surface = pose.point_out(way * zone.half_size);
                let beyond = surface + pose.rotation * way * zone.outward * SECONDS;
                gizmos.arrow(surface, beyond, color);
            }
        }
    }
    for (color, pose, _) in placed(with.blowers, &blowers) {
        let tip = pose.translation + pose.rotation * Vec3::NEG_Z * BLOWN;
        gizmos.circle(Isometry3d::new(pose.translation, pose.rotation), 0.1 * BLOWN, color);
        gizmos.arrow(pose.translation, tip, color);
    }
    for (color, pose, rod) in placed(with.perm_rods, &rods) {
        shapes::cylinder(&mut gizmos, &pose, rod.radius, rod.length, color);
    }
    for (color, pose, water) in stretched(with.water_volumes, &volumes) {
        shapes::zone(&mut gizmos, &pose, water.shape, water.half_size, color);
    }
}

/// What is drawn in a colour, with valid values and poses; nothing without a colour.
fn placed<'a, T: Component + Ranged + Clone>(
    color: Option<Color>,
    all: &'a Query<(&GlobalTransform, &T)>,
) -> impl Iterator<Item = (Color, Pose, T)> + 'a {
    placed_as(color, all, |what, _| what.clamped())
}

/// The same as they act.
fn stretched<'a, T: Stretched>(
    color: Option<Color>,
    all: &'a Query<(&GlobalTransform, &T)>,
) -> impl Iterator<Item = (Color, Pose, T)> + 'a {
    placed_as(color, all, acting)
}

fn placed_as<'a, T: Component>(
    color: Option<Color>,
    all: &'a Query<(&GlobalTransform, &T)>,
    valid: impl Fn(&T, &GlobalTransform) -> T + 'a,
) -> impl Iterator<Item = (Color, Pose, T)> + 'a {
    let all = color.map(|color| all.iter().map(move |(at, what)| (color, at, what)));
    let all = all.into_iter().flatten();
    all.filter_map(move |(color, at, what)| Some((color, Pose::of(at)?, valid(what, at))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{prelude::*, run_ticks};
    use bevy::{mesh::skinning::SkinnedMeshInverseBindposes, transform::TransformPlugin};

    fn app() -> App {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default()))
            .init_asset::<Mesh>()
            .init_asset::<SkinnedMeshInverseBindposes>()
            .init_asset::<GizmoAsset>()
            .add_plugins((HairPlugins::default(), HairDebugPlugin));
        app.finish();
        app
    }

    fn only(app: &mut App, gizmos: HairGizmos) {
        *app.world_mut().resource_mut::<GizmoConfigStore>().config_mut::<HairGizmos>().1 = gizmos;
    }

    fn none() -> HairGizmos {
        HairGizmos {
            simulated: None,
            asleep: None,
            followers: None,
            frozen: None,
            gpu: None,
            settling: None,
            guides: None,
            contacts: None,
            colliders: None,
            wind_zones: None,
            blowers: None,
            perm_rods: None,
            water_volumes: None,
        }
    }

    /// The points of lines drawn in the last frame.
    fn points(app: &App) -> Vec<Vec3> {
        let all = app.world().resource::<Assets<GizmoAsset>>().iter();
        let places = all.flat_map(|(_, asset)| {
            let lines = asset.buffer();
            lines.strip_positions.iter().chain(&lines.list_positions).copied().collect::<Vec<_>>()
        });
        places.filter(|p| !p.is_nan()).collect()
    }

    fn grow(app: &mut App, kind: impl Bundle, roots: &[f32]) -> Entity {
        let hair = app.world_mut().spawn((Hair, SleepSettings::never(), kind)).id();
        for x in roots {
            let points = [0.0, 0.05, 0.1].map(|y| Vec3::new(*x, -y, 0.0));
            let strand = Strand::from_polyline(&points).unwrap();
            app.world_mut().spawn((StrandOf(hair), strand));
        }
        hair
    }

    const RED: Option<Color> = Some(Color::WHITE);

    #[test]
    fn strands_are_drawn_where_they_are_in_the_world_by_what_moves_them() {
        let mut app = app();
        let level = crate::LodLevel { below: 10.0, strands: 0.25, ..default() };
        let lod = HairLod { levels: vec![level], ..default() };
        grow(&mut app, (lod, Transform::from_xyz(3.0, 0.0, 0.0)), &[0.0, 0.1, 0.2, 0.3]);
        run_ticks(&mut app, 3);
        for (gizmos, strands) in [
            (HairGizmos { simulated: RED, ..none() }, 1),
            (HairGizmos { followers: RED, ..none() }, 3),
            (HairGizmos { asleep: RED, frozen: RED, gpu: RED, settling: RED, ..none() }, 0),
        ] {
            only(&mut app, gizmos);
            // The lines of a frame are freed in the next one.
            run_ticks(&mut app, 2);
            let points = points(&app);
            assert_eq!(points.len(), 3 * strands);
            assert!(points.iter().all(|p| (2.9..3.4).contains(&p.x)));
        }
        only(&mut app, HairGizmos { guides: RED, ..none() });
        run_ticks(&mut app, 1);
        let lines = points(&app);
        assert_eq!(lines.len(), 2 * 3, "from each follower to its one guide");
        assert!(lines.iter().all(|p| p.y == 0.0), "at the roots");
    }

    #[test]
    fn nothing_is_drawn_while_it_is_disabled() {
        let mut app = app();
        grow(&mut app, (), &[0.0]);
        app.world_mut().spawn(HairCollider::sphere(0.1).unwrap());
        run_ticks(&mut app, 2);
        assert!(points(&app).len() > 3);
        let mut store = app.world_mut().resource_mut::<GizmoConfigStore>();
        store.config_mut::<HairGizmos>().0.enabled = false;
        run_ticks(&mut app, 2);
        assert!(points(&app).is_empty());
    }

    #[test]
    fn pairs_of_strands_that_touch_are_drawn() {
        let mut app = app();
        let near = StrandContact { radius: 2e-3, ..default() };
        grow(&mut app, near, &[0.0, 3e-3]);
        grow(&mut app, near, &[1.0, 1.01]);
        only(&mut app, HairGizmos { contacts: RED, ..none() });
        run_ticks(&mut app, 2);
        let points = points(&app);
        assert!(!points.is_empty() && points.iter().all(|p| p.x < 0.01), "{points:?}");
        let (lines, _) = points.as_chunks::<2>();
        for [a, b] in lines {
            assert!((1e-3..4.1e-3).contains(&a.distance(*b)), "within twice the radius");
        }
    }

    #[test]
    fn surroundings_are_drawn_each_in_its_place() {
        let mut app = app();
        let at = |x: f32| Transform::from_xyz(x, 0.0, 0.0);
        let world = app.world_mut();
        world.spawn((HairCollider::sphere(0.1).unwrap(), at(10.0)));
        let zone = WindZone { outward: 1.0, velocity: Vec3::Y, ..WindZone::shelter() };
        world.spawn((zone, at(20.0)));
        world.spawn((Blower::default(), at(30.0)));
        world.spawn((PermRod::default(), at(40.0)));
        world.spawn((WaterVolume::default(), at(50.0)));
        world.spawn((HairCollider::sphere(0.1).unwrap(), Transform::from_xyz(f32::NAN, 0.0, 0.0)));
        run_ticks(&mut app, 1);
        for (gizmos, x) in [
            (HairGizmos { colliders: RED, ..none() }, 10.0),
            (HairGizmos { wind_zones: RED, ..none() }, 20.0),
            (HairGizmos { blowers: RED, ..none() }, 30.0),
            (HairGizmos { perm_rods: RED, ..none() }, 40.0),
            (HairGizmos { water_volumes: RED, ..none() }, 50.0),
        ] {
            only(&mut app, gizmos);
            run_ticks(&mut app, 1);
            let points = points(&app);
            assert!(points.len() > 8 && points.iter().all(|p| (p.x - x).abs() < 3.0), "{x}");
        }
    }
}
