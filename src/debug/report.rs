//! What a hair is like now, and why: for games, inspectors and whoever looks for a fault.

use super::{Owner, Owners};
#[cfg(feature = "gpu")]
use crate::gpu::HairResidence;
use crate::{
    base::{schedule::HairTicks, setting::Settings},
    forces::environment::{HairClimate, Winds},
    hair::{
        strand::{
            Hair, MotionOwner, Settling, Strand, StrandOf, StrandSleep, Strands, TickPose,
            lacks_strands,
        },
        worn::HairsOf,
    },
    hairdo::style::HairCondition,
    simulation::{
        lod::PresentLod,
        sleep::{SleepSettings, is_blown},
    },
};
use bevy::{ecs::system::SystemParam, prelude::*};
use core::fmt;

/// Fills [`HairReport`]s once a frame, after its ticks. Part of [`HairPlugins`](crate::HairPlugins); where no entity has
/// one it does nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReportPlugin;

impl Plugin for ReportPlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        let asked = any_with_component::<HairReport>;
        app.register_type::<HairReport>()
            .register_type::<WhyMoved>()
            .add_systems(PostUpdate, fill_reports.after(HairTicks).run_if(asked));
    }
}

/// What a hair is like at the moment, and who moves it for which reason. To be read by a game or an inspector: put
/// the default on a [`Hair`] or on who wears it, and it is filled once a frame after the ticks; or ask [`HairReports`]
/// when you need it. Hair without one costs nothing. [`Display`](fmt::Display) gives it in words.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// fn watch(In(character): In<Entity>, mut commands: Commands) {
///     commands.entity(character).insert(HairReport::default()); // and look at it in an inspector
/// }
/// ```
///
/// Hair on the GPU is reported as it was when it was last read back.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct HairReport {
    /// Who moves it; of several hairs of one wearer, one that moves, if any does.
    pub owner: MotionOwner,
    /// Why.
    pub why: WhyMoved,
    /// Where it is simulated, and why not on the GPU.
    #[cfg(feature = "gpu")]
    pub residence: HairResidence,
    /// How many strands it has.
    pub strands: usize,
    /// Of these, how many are simulated in this tick, here or on the GPU.
    pub awake: usize,
    /// How many sleep.
    pub asleep: usize,
    /// How many follow others at its level of detail.
    pub followers: usize,
    /// Its level of detail: 0 in full.
    pub level: usize,
    /// How many levels coarser that is because of the [`HairBudget`](crate::HairBudget).
    pub budget_levels: usize,
    /// Mean wetness inside, see [`HairCondition::wetness`]: 0 as in a room, 1 soaked.
    pub wetness: f32,
    /// Water on and in it beyond the regain of a room (kg), see [`HairCondition::water`].
    pub water: f64,
    /// How much of its [`HairStyle`](crate::HairStyle) is left, see [`HairCondition::kept_style`]; `None` without one.
    pub kept_style: Option<f32>,
    /// The warmest air at roots, middles and tips of its strands (°C): the room's, a blower's, a fire's. Hair has no
    /// temperature of its own here; the air's decides how fast it dries.
    pub air: f32,
    /// The largest strain of a segment, |length/rest − 1|.
    pub worst_strain: f32,
    /// The strand that has it.
    #[entities]
    pub worst_strand: Option<Entity>,
    /// The fastest node (m/s, in the frame and units of its hair, as [`Strand::velocities`](crate::Strand::velocities)).
    pub fastest: f32,
}

/// Why a hair has the [`MotionOwner`] that it has.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Clone, PartialEq)]
#[non_exhaustive]
pub enum WhyMoved {
    /// It has no strands.
    #[default]
    NoStrands,
    /// It moves or is about to: it has not been still for as long as [`SleepSettings`] say, or its bonds or water change.
    Awake,
    /// Its [`SleepSettings`] let it never sleep.
    NeverSleeps,
    /// Moving air reaches a strand: such hair does not sleep.
    InWind,
    /// All its strands have been still for as long as its [`SleepSettings`] say.
    AtRest,
    /// It is simulated ahead before it is first drawn, so many ticks so far.
    Settles(u32),
    /// It plays a cache of a groom's motion (`PlayGroomCache`).
    Played,
    /// Its head is scaled down to be hidden: [`HairInertia::hidden_scale`](crate::HairInertia::hidden_scale).
    Hidden,
    /// Its level of detail simulates no strand, because it is small on the screen.
    Small,
    /// As [`Small`](Self::Small), because of the [`HairBudget`](crate::HairBudget).
    OverBudget,
    /// It is asked to be on the GPU ([`SimulateOn`](crate::gpu::SimulateOn)), and all that acts on it is supported there.
    #[cfg(feature = "gpu")]
    AskedForGpu,
}

impl fmt::Display for WhyMoved {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoStrands => "it has no strands",
            Self::Awake => "it has not been still for long enough",
            Self::NeverSleeps => "its SleepSettings never let it sleep",
            Self::InWind => "moving air reaches it",
            Self::AtRest => "all of it has been still",
            Self::Settles(ticks) => return write!(f, "{ticks} ticks ahead so far"),
            Self::Played => "a groom cache is played on it",
            Self::Hidden => "its head is scaled down to be hidden",
            Self::Small => "it is small on the screen",
            Self::OverBudget => "the HairBudget is spent",
            #[cfg(feature = "gpu")]
            Self::AskedForGpu => "it is asked to be there",
        })
    }
}

impl fmt::Display for HairReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { owner, why, strands, awake, asleep, followers, level, .. } = self;
        write!(f, "{owner:?}, since {why}; {strands} strands: {awake} awake, {asleep} asleep, ")?;
        write!(f, "{followers} followers at level {level}")?;
        #[cfg(feature = "gpu")]
        if let HairResidence::Cpu(why) | HairResidence::Returning(why) = self.residence {
            write!(f, "; not on the GPU: {why}")?;
        }
        let (wet, grams) = (100.0 * self.wetness, 1e3 * self.water);
        write!(f, "; {wet:.0} % wet with {grams:.1} g of water in air of {:.0} °C", self.air)?;
        if let Some(kept) = self.kept_style {
            write!(f, "; {:.0} % of its style left", 100.0 * kept)?;
        }
        let (strain, fastest) = (100.0 * self.worst_strain, self.fastest);
        write!(f, "; strained by {strain:.2} % at most, at most {fastest:.3} m/s fast")
    }
}

/// What is known of one hair as a whole.
type Known = (
    &'static MotionOwner,
    &'static TickPose,
    Option<&'static Strands>,
    Option<&'static Settling>,
    Option<&'static PresentLod>,
);

/// System parameter that makes [`HairReport`]s when a system asks for them.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// fn stretched(hairs: Query<Entity, With<Hair>>, reports: HairReports) {
///     for report in hairs.iter().filter_map(|hair| reports.of(hair)) {
///         if report.worst_strain > 0.05 {
///             warn!("{report}");
///         }
///     }
/// }
/// ```
#[derive(SystemParam)]
pub struct HairReports<'w, 's> {
    condition: HairCondition<'w, 's>,
    of: HairsOf<'w, 's>,
    owners: Owners<'w, 's>,
    hairs: Query<'w, 's, Known, With<Hair>>,
    #[cfg(feature = "gpu")]
    residences: Query<'w, 's, &'static HairResidence>,
    strands: Query<'w, 's, (Entity, &'static Strand, &'static StrandOf, &'static StrandSleep)>,
    sleep: Settings<'w, 's, SleepSettings>,
    winds: Winds<'w, 's>,
    climate: Option<Res<'w, HairClimate>>,
}

impl HairReports<'_, '_> {
    /// The report of a hair, or of all that an entity wears; `None` where that is no hair and wears none.
    pub fn of(&self, entity: Entity) -> Option<HairReport> {
        let hairs = self.of.of(&entity).iter().filter_map(|hair| self.of_one(*hair));
        let mut report = hairs.reduce(HairReport::and)?;
        report.wetness = self.condition.wetness(entity);
        report.water = self.condition.water(entity);
        report.kept_style = self.condition.kept_style(entity);
        Some(report)
    }

    /// Without what [`HairCondition`] knows.
    fn of_one(&self, hair: Entity) -> Option<HairReport> {
        let (owner, pose, members, settling, lod) = self.hairs.get(hair).ok()?;
        let room = self.climate.as_ref().map_or(HairClimate::default().celsius, |air| air.celsius);
        let winds = self.winds.seen_from(pose);
        let mut report = HairReport {
            owner: *owner,
            air: room,
            level: lod.map_or(0, |lod| lod.level),
            budget_levels: lod.map_or(0, |lod| lod.budget_levels),
            ..default()
        };
        #[cfg(feature = "gpu")]
        if let Ok(residence) = self.residences.get(hair) {
            report.residence = *residence;
        }
        let mut blown = false;
        for (id, strand, of, sleep) in
            self.strands.iter_many(members.into_iter().flat_map(Strands::iter))
        {
            report.strands += 1;
            match self.owners.of(of, sleep) {
                Owner::Simulated | Owner::Settling | Owner::Gpu => report.awake += 1,
                Owner::Asleep => report.asleep += 1,
                Owner::Follower => report.followers += 1,
                Owner::Frozen => {}
            }
            let strain = strand.peak_strain();
            if strain > report.worst_strain || report.worst_strand.is_none() {
                (report.worst_strain, report.worst_strand) = (strain, Some(id));
            }
            let speeds = strand.velocities().iter().map(|v| v.length());
            report.fastest = speeds.fold(report.fastest, f32::max);
            if strand.nodes() > 1 && !winds.are_still() {
                blown |= is_blown(strand, &winds);
                let p = strand.positions();
                let warmth = [0, p.len() / 2, p.len() - 1].map(|i| winds.around(p[i]).warmth(room));
                report.air = warmth.into_iter().fold(report.air, |air, by| air.max(room + by));
            }
        }
        if owner.sleeps() {
            (report.asleep, report.awake) = (report.asleep + report.awake, 0);
        }
        report.why = match owner {
            _ if report.strands == 0 => WhyMoved::NoStrands,
            MotionOwner::Played => WhyMoved::Played,
            MotionOwner::Settling => WhyMoved::Settles(settling.map_or(0, |of| of.done)),
            MotionOwner::Frozen if pose.waits() => WhyMoved::Hidden,
            MotionOwner::Frozen if lod.is_some_and(PresentLod::wants_simulation) => {
                WhyMoved::OverBudget
            }
            MotionOwner::Frozen => WhyMoved::Small,
            MotionOwner::Asleep | MotionOwner::AsleepOnGpu => WhyMoved::AtRest,
            #[cfg(feature = "gpu")]
            MotionOwner::Gpu => WhyMoved::AskedForGpu,
            _ if self.sleep.of(hair).seconds == f32::INFINITY => WhyMoved::NeverSleeps,
            _ if blown => WhyMoved::InWind,
            _ => WhyMoved::Awake,
        };
        Some(report)
    }
}

impl HairReport {
    /// Of two hairs of one wearer; without what [`HairCondition`] knows.
    fn and(self, other: Self) -> Self {
        let (mut one, other) = match other.owner.moves() && !self.owner.moves() {
            true => (other, self),
            false => (self, other),
        };
        one.strands += other.strands;
        one.awake += other.awake;
        one.asleep += other.asleep;
        one.followers += other.followers;
        one.air = one.air.max(other.air);
        one.fastest = one.fastest.max(other.fastest);
        if other.worst_strain > one.worst_strain {
            (one.worst_strain, one.worst_strand) = (other.worst_strain, other.worst_strand);
        }
        one
    }
}

fn fill_reports(reports: HairReports, mut asked: Query<(Entity, &mut HairReport)>) {
    for (entity, mut report) in &mut asked {
        report.set_if_neq(reports.of(entity).unwrap_or_default());
    }
}
