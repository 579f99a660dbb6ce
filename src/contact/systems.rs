//! `Interaction`: strands push each other apart, colliders are seen from each hair's frame.

use super::{ColliderShape, HairCollider, LockContact, LockNeighbours, Obstacles, coarse};
use crate::{
    fault::{FaultKind, HairFault},
    parallel::prefetch,
    rod::obstacle::{Obstacle, Solid},
    schedule::{EffectiveSubsteps, HairSystems, HairTick},
    setting::{self, Ranged, Settings},
    strand::{Hair, Sleepers, StillPose, Strand, StrandOf, StrandSleep, Strands, TickPose},
};
use bevy::prelude::*;

/// How many strands' memory is asked for at once.
const TOGETHER: usize = 16;

/// Colliders and contact between strands.
pub struct ContactPlugin;

impl Plugin for ContactPlugin {
    fn build(&self, app: &mut App) {
        setting::plugin::<LockContact>(app);
        #[cfg(feature = "avian")]
        super::avian::plugin(app);
        setting::component::<HairCollider>(app);
        app.register_type::<ColliderShape>()
            .register_type::<Obstacles>()
            .register_type::<LockNeighbours>()
            .register_required_components::<Hair, Obstacles>()
            .register_required_components::<Hair, LockNeighbours>()
            .add_systems(
                HairTick,
                (
                    gather_obstacles.in_set(HairSystems::Obstacles),
                    push_strands_apart.in_set(HairSystems::StrandContact),
                ),
            );
    }
}

/// A collider in a hair's frame, with the way its surface goes there during the substep.
pub(crate) fn seen_from(hair: &TickPose, collider: &HairCollider, pose: &TickPose) -> Obstacle {
    let (now, own) = (hair.now(), pose.now());
    let scale = own.scale / now.scale;
    let at = now.point_in(own.translation);
    let turned = |d: Vec3| now.direction_in(own.rotation * d);
    let solid = match collider.shape {
        ColliderShape::Sphere(s) => Solid::Capsule { a: at, b: at, radius: s.radius * scale },
        ColliderShape::Capsule(c) => {
            let half = turned(Vec3::Y) * (c.half_length * scale);
            Solid::Capsule { a: at - half, b: at + half, radius: c.radius * scale }
        }
        ColliderShape::Plane(p) => Solid::HalfSpace { normal: turned(*p.normal), point: at },
        ColliderShape::Cylinder(c) => Solid::Cylinder {
            center: at,
            axis: turned(Vec3::Y),
            radius: c.radius * scale,
            half_height: c.half_height * scale,
        },
    };
    let motion = pose.motion_in(hair);
    Obstacle { solid, motion, friction: collider.friction }
}

fn gather_obstacles(
    colliders: Query<(&HairCollider, &TickPose)>,
    mut hairs: Query<(&TickPose, &mut Obstacles), With<Hair>>,
) {
    for (hair, mut obstacles) in &mut hairs {
        obstacles.solids.clear();
        obstacles
            .solids
            .extend(colliders.iter().map(|(c, pose)| seen_from(hair, &c.clamped(), pose)));
    }
}

fn too_fine(strand: &Strand, radius: f32, stride: usize) -> HairFault {
    let segment = 1e3 * strand.length() / strand.edges() as f32;
    let message = format!(
        "segments of a strand are {segment:.3} mm long, expected at least its lock's radius of {} mm: \
         contact looks at every {stride}th of its {} nodes, fewer nodes would do",
        1e3 * radius,
        strand.nodes(),
    );
    HairFault::new(FaultKind::Strand, message)
}

pub(crate) fn push_strands_apart(
    steps: EffectiveSubsteps,
    contact: Settings<LockContact>,
    mut hairs: Query<(Entity, &Strands, &mut LockNeighbours, Option<&Sleepers>), With<Hair>>,
    mut strands: Query<(&mut Strand, &mut StrandSleep, &mut StillPose), With<StrandOf>>,
    mut faults: MessageWriter<HairFault>,
) {
    for (hair, members, mut neighbours, sleepers) in &mut hairs {
        let LockContact { radius, strength } = contact.of(hair);
        if radius <= 0.0 || strength <= 0.0 || sleepers.is_some_and(Sleepers::all) {
            continue;
        }
        let Some(stride) = steps.of(hair) else { continue };
        let LockNeighbours { lists: list, is_told } = neighbours.bypass_change_detection();
        let reach = 2.0 * radius;
        list.clear();
        // Follower strands neither push nor are pushed. Where water joins strands, it joins them too.
        let with_followers = list.has_extra_margin();
        for some in members.collection().chunks(TOGETHER) {
            strands.iter_many(some).for_each(|(strand, ..)| prefetch(strand.positions()));
            for (strand, sleep, _) in strands.iter_many(some) {
                if with_followers || !sleep.is_follower() {
                    let stride = coarse::stride(strand.rest_lengths(), reach);
                    list.add(strand.positions(), stride);
                    if stride > 1 && !core::mem::replace(is_told, true) {
                        faults.write(too_fine(strand, radius, stride).of(hair));
                    }
                }
            }
        }
        let mut pushes = list.pushes(radius, strength);
        for some in members.collection().chunks(TOGETHER) {
            strands.iter_many(some).for_each(|(strand, ..)| prefetch(strand.velocities()));
            let mut some = strands.iter_many_mut(some);
            while let Some((mut strand, mut sleep, mut still)) = some.fetch_next() {
                if sleep.is_follower() && !with_followers {
                    continue;
                }
                if sleep.is_asleep() {
                    let pushes = pushes.by_ref().take(strand.nodes());
                    if still.bypass_change_detection().feels(pushes, strength / (2.0 * radius)) {
                        sleep.bypass_change_detection().wake();
                    }
                    continue;
                }
                let (_, velocities, ..) = strand.bypass_change_detection().parts_mut();
                velocities.iter_mut().zip(&mut pushes).for_each(|(v, push)| *v += push * stride.dt);
            }
        }
    }
}
