//! Hair that settles away from the world: on another thread, in no time of the game.

use super::{SettleSettings, Settling, systems::settle};
use crate::{
    base::{
        fault::{FaultKind, HairFault},
        schedule::{HairSubsteps, HairTicked, HairTicks, TickPlugin},
        setting::{HairDefault, Ranged},
    },
    forces::{
        contact::{ContactPlugin, HairCollider, StrandContact},
        environment::{AirDrag, EnvironmentPlugin, HairGravity},
    },
    hair::strand::{Hair, Strand, StrandModel, StrandOf, StrandPlugin},
    keratin::bond::{BondInfluence, BondPlugin, Bonds, Cuticle},
    simulation::solve::{RodPlugin, SpringPlugin},
    solver::{
        mass_spring::Springs,
        rod::{HairSolver, HairStiffness, StrandMaterial, Sweeps},
    },
};
use bevy::{
    ecs::schedule::SingleThreadedExecutor,
    prelude::*,
    time::{TimePlugin, TimeUpdateStrategy},
};
use core::time::Duration;

/// How many ticks run until it is asked whether the hair is still wanted.
const AT_ONCE: u32 = 8;

/// States once by which settings hair settles.
macro_rules! settle_conditions {
    ($($field:ident: $Setting:ty),* $(,)?) => {
        /// What hair depends on while it settles: clock, gravity, and settings of all hair and of a wearer.
        #[derive(Clone, Debug, PartialEq)]
        pub(crate) struct SettleConditions {
            tick: Duration,
            substeps: HairSubsteps,
            /// In the world (m/s²).
            pub(crate) gravity: Vec3,
            $($field: [Option<$Setting>; 2],)*
        }

        impl SettleConditions {
            /// Those of a world and of one of its wearers.
            pub(crate) fn of(world: &World, wearer: Entity) -> Self {
                let gravity = world.get_resource::<HairGravity>().map(Ranged::clamped);
                let clock = world.get_resource::<Time<Fixed>>().copied().unwrap_or_default();
                Self {
                    tick: clock.timestep(),
                    substeps: world.get_resource().copied().unwrap_or_default(),
                    gravity: gravity.map_or(Vec3::ZERO, |gravity| gravity.0),
                    $($field: [
                        world.get_resource::<HairDefault<$Setting>>().map(|all| all.0.clone()),
                        world.get::<$Setting>(wearer).cloned(),
                    ],)*
                }
            }

            fn put(&self, world: &mut World, hair: Entity) {
                $(
                    let [all, own] = self.$field.each_ref().map(|value| value.as_ref().cloned());
                    if let Some(all) = all {
                        world.insert_resource(HairDefault(all));
                    }
                    if let Some(own) = own {
                        world.entity_mut(hair).insert(own);
                    }
                )*
            }
        }
    };
}

settle_conditions! {
    model: StrandModel,
    solver: HairSolver,
    stiffness: HairStiffness,
    sweeps: Sweeps,
    springs: Springs,
    influence: BondInfluence,
    cuticle: Cuticle,
    contact: StrandContact,
    drag: AirDrag,
    settling: SettleSettings,
}

impl SettleConditions {
    /// `None` without the plugin that settles hair.
    fn settling(&self) -> Option<SettleSettings> {
        let [all, own] = self.settling;
        all.map(|all| own.unwrap_or(all).clamped())
    }
}

/// Hair that is to settle, with all that it meets.
pub(crate) struct SettleAhead<'a> {
    /// As planted, in the hair's frame.
    pub(crate) strands: &'a [Strand],
    /// How stiff each is beside the others; empty where all are alike.
    pub(crate) materials: &'a [StrandMaterial],
    /// What the hair has of its own, whatever holds for all hair.
    pub(crate) own: Option<(HairStiffness, StrandContact)>,
    /// Colliders in the hair's frame.
    pub(crate) solids: &'a [(HairCollider, Transform)],
    /// How many metres one of the hair's frame is.
    pub(crate) size: f32,
    /// Gravity along the axes of the hair's frame (m/s²).
    pub(crate) gravity: Vec3,
    pub(crate) conditions: &'a SettleConditions,
}

/// Hair at rest: its strands with their bonds, and what was reported of them.
#[derive(Debug)]
pub(crate) struct Settled {
    pub(crate) strands: Vec<(Strand, Bonds)>,
    pub(crate) faults: Vec<HairFault>,
}

impl Settled {
    /// Hair as it was planted.
    pub(crate) fn as_planted(strands: &[Strand]) -> Self {
        let whole = |strand: &Strand| (strand.clone(), Bonds::of(strand));
        Self { strands: strands.iter().map(whole).collect(), faults: Vec::new() }
    }
}

#[derive(Resource, Default)]
struct Faults(Vec<HairFault>);

/// Before they are logged, with entities that nobody knows.
fn take_faults(mut written: ResMut<Messages<HairFault>>, mut faults: ResMut<Faults>) {
    // Settings out of their range are reported where they are.
    faults.0.extend(written.drain().filter(|fault| fault.kind != FaultKind::Setting));
}

impl SettleAhead<'_> {
    /// Simulates it in a world of its own until it is at rest; `None` when it is no longer `wanted`. The same
    /// hair comes to rest in the same bits.
    pub(crate) fn settle(&self, wanted: impl Fn() -> bool) -> Option<Settled> {
        let settings = self.conditions.settling().filter(|settings| settings.ticks > 0);
        let Some(settings) = settings.filter(|_| !self.strands.is_empty()) else {
            return Some(Settled::as_planted(self.strands));
        };
        let mut app = App::new();
        app.add_plugins((
            TimePlugin,
            TickPlugin::default(),
            StrandPlugin,
            BondPlugin,
            EnvironmentPlugin,
            ContactPlugin,
            RodPlugin,
            SpringPlugin,
        ))
        .add_systems(HairTicked, settle.run_if(any_with_component::<Settling>))
        .insert_resource(Time::<Fixed>::from_duration(self.conditions.tick))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
        .insert_resource(self.conditions.substeps)
        .insert_resource(HairGravity(self.gravity))
        .init_resource::<Faults>()
        .add_systems(PostUpdate, take_faults.after(HairTicks));
        app.finish();
        app.cleanup();
        let world = app.world_mut();
        // No thread of the game's frames runs systems of this world.
        for (_, schedule) in world.resource_mut::<Schedules>().iter_mut() {
            schedule.set_executor(SingleThreadedExecutor::new());
        }
        world.resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
        let place = Transform::from_scale(Vec3::splat(self.size));
        let hair = world.spawn((Hair, place, Settling::default())).id();
        if let Some(own) = self.own {
            world.entity_mut(hair).insert(own);
        }
        self.conditions.put(world, hair);
        world.entity_mut(hair).insert(SettleSettings { at_once: AT_ONCE, ..settings });
        let strands = self.strands.iter().map(|strand| (StrandOf(hair), strand.clone()));
        let strands: Vec<Entity> = world.spawn_batch(strands.collect::<Vec<_>>()).collect();
        for (strand, own) in strands.iter().zip(self.materials) {
            world.entity_mut(*strand).insert(*own);
        }
        for (collider, place) in self.solids {
            world.spawn((collider.clone(), *place, ChildOf(hair)));
        }
        // No time passes in the first.
        app.update();
        // At the latest its ticks are used up.
        for _ in 0..=settings.ticks {
            if !wanted() {
                return None;
            }
            app.update();
            if !app.world().entity(hair).contains::<Settling>() {
                break;
            }
        }
        let world = app.world_mut();
        let rested = strands.into_iter().filter_map(|strand| {
            let mut strand = world.get_entity_mut(strand).ok()?;
            Some((strand.take::<Strand>()?, strand.take::<Bonds>()?))
        });
        let strands: Vec<_> = rested.collect();
        let faults = core::mem::take(&mut world.resource_mut::<Faults>().0);
        Some(Settled { strands, faults })
    }
}
