//! The tick: figure 1 of \[B\], read from top to bottom. The only file that defines the order.
//!
//! Each fixed tick runs the schedule [`HairTick`] once per substep, with the sets of
//! [`HairSystems`] one after the other. It runs on a single thread and treats ambiguities as errors;
//! systems run in parallel inside, over strands.

use crate::base::{
    fault::{self, FaultKind, HairFault},
    motion::{TickMoment, WorldMotion, close_frame, note_tick, see_frame},
    setting::{self, InvalidValue, Ranged, ValueRange, Violations},
};
use bevy::{
    app::{AnimationSystems, FixedMain, RunFixedMainLoopSystems},
    ecs::{
        entity::EntityHashSet,
        schedule::{
            InternedScheduleLabel, IntoScheduleConfigs, LogLevel, ScheduleBuildSettings,
            ScheduleConfigs, ScheduleLabel, SingleThreadedExecutor,
        },
        system::{ScheduleSystem, SystemParam},
    },
    platform::collections::HashSet,
    prelude::*,
    time::run_fixed_main_schedule,
    utils::prelude::ShortName,
};
use core::any::TypeId;

/// The schedule of one substep. Add systems to it in one of [`HairSystems`], `First` and `Last` best.
#[derive(ScheduleLabel, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct HairTick;

/// The schedule of a substep of hair that is simulated ahead: only the systems that move strands,
/// in the sets of [`HairSystems`], without bonds, water and treatments. See
/// [`Settling`](crate::Settling).
#[derive(ScheduleLabel, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SettleTick;

/// What is done once a frame, in [`PreUpdate`], before the ticks. On a single thread: each of its
/// systems is done before another thread would have woken.
#[derive(ScheduleLabel, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct HairFrame;

/// The set of the ticks in the schedule that runs them: [`PostUpdate`] by default. What moves a head there,
/// for instance inverse kinematics, runs before it.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct HairTicks;

/// What is done after each tick.
#[derive(ScheduleLabel, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct HairTicked;

/// The hair that takes a [`SettleTick`] while all other hair waits; `None` in the tick itself.
#[derive(Resource, Clone, Debug, Default)]
pub(crate) struct SettleTickHairs(pub(crate) Option<EntityHashSet>);

/// States the order of a substep once: sets, their parts, and what each does. The enum, the order of
/// the schedule and the table in the docs are made from it.
macro_rules! substep {
    ($($set:ident: $does:literal { $($part:ident: $part_does:literal,)* })*) => {
        /// The parts of a substep, in the order they run.
        ///
        /// Each of the eight sets of \[B\]'s figure 1 is made of parts, which are sets too. All run one
        /// after the other, so that a system may be ordered against any of them.
        ///
        /// | set | part | what it does |
        /// |---|---|---|
        $(
            #[doc = concat!("| [`", stringify!($set), "`](Self::", stringify!($set), ") | | ", $does, " |")]
            $(#[doc = concat!(
                "| | [`", stringify!($part), "`](Self::", stringify!($part), ") | ", $part_does, " |"
            )])*
        )*
        #[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum HairSystems {
            $(
                #[doc = concat!($does, ".")]
                $set,
                $(
                    #[doc = concat!($part_does, ". Part of [`", stringify!($set), "`](Self::", stringify!($set), ").")]
                    $part,
                )*
            )*
        }

        impl HairSystems {
            /// The sets of the paper's figure in their order.
            pub const ALL: [Self; 8] = [$(Self::$set),*];

            /// The parts of a set in their order; none for a part.
            pub fn parts(self) -> &'static [Self] {
                match self {
                    $(Self::$set => &[$(Self::$part),*],)*
                    _ => &[],
                }
            }

            /// What it does, in one line.
            pub fn description(self) -> &'static str {
                match self {
                    $(Self::$set => $does, $(Self::$part => $part_does,)*)*
                }
            }
        }
    };
}

substep! {
    First: "Empty, for users" {}
    Roots: "Where the scalp is now" {
        StrandHistory: "The present positions become the previous ones, for drawing between ticks",
        Poses: "Frames of hair, colliders, rods and blowers move by a substep",
        LevelOfDetail: "Levels and guides are chosen, once a tick",
        SubstepLength: "How many substeps each hair takes as one, once a tick",
        Sleep: "Strands at rest fall asleep, disturbed ones wake, once a tick",
        FollowerSleep: "Followers sleep while all their guides do, once a tick",
        Owners: "Who moves each hair from now on, once a tick",
        FrameInertia: "Inertia of free nodes when the hair's frame moves",
        MeshRoots: "Roots follow the triangles that they grow on",
        BondFit: "New and changed strands get bonds for each joint",
    }
    ExternalForces: "Forces from outside, and requests for changes of bonds" {
        Submersion: "Buoyancy, drag and wetting of hair under water",
        Air: "Gravity, wind (equation 17) and drag; drying (19) of hair without water",
        Treatments: "Lotions, heat and other treatments of bonds",
        WaterExchange: "Showers spawn drops; hair soaks, films flow, water dries and hydrogen bonds follow",
    }
    Interaction: "Contacts" {
        Obstacles: "Colliders are transformed into the frame of each hair",
        StrandContact: "Strands push each other apart (equation 18)",
        Droplets: "Droplets move, land and merge",
        DropletContact: "Droplets pull the strands they touch (\\[W\\] 2 to 5)",
        Bridges: "Films between wet strands pull them together",
        RodWinding: "Perm rods guide the strands wound on them",
        Ties: "Hair ties gather their strands and hold them",
    }
    RestShape: "Stiffness from the cuticle (13, 14), rest shapes from the bonds (15)" {}
    Projection: "Positions and velocities" {
        Rods: "Cosserat rods: predict, project, limit lengths, velocities (1 to 12)",
        Springs: "Mass-spring strands (\\[W\\] 1)",
        StrandCores: "Firm cores of strands are kept apart, where contact is by pairs",
        Followers: "Strands that are not simulated follow their guides, once a tick",
    }
    BondUpdate: "Bonds that re-formed remember the present shape (16)" {
        BondRates: "Rates move, memories follow (16)",
        WaterLedger: "Droplets follow their strands; the water balance is summed",
        Styles: "How much is left of styles, once a tick",
    }
    Last: "Empty, for users" {}
}

/// The number of substeps of a tick.
///
/// Droplets, springs and the paper's projections need the paper's step. Dry hair that is solved directly
/// is as accurate in longer ones and takes several as one: see
/// [`HairSolver::substep`](crate::HairSolver::substep).
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq)]
pub enum HairSubsteps {
    /// As many as bring the substep to the paper's 1/360 s or just below, whatever the app's rate:
    /// 6 at 60 Hz, 3 at 120 Hz.
    #[default]
    Auto,
    /// This many; values outside [`RANGE`](Self::RANGE) are clamped.
    Fixed(u32),
}

impl HairSubsteps {
    /// The range of the number of substeps.
    pub const RANGE: ValueRange =
        ValueRange::new("HairSubsteps", 1.0..=1000.0, "6 suit a tick of 1/60 s")
            .with_safe(1.0..=24.0);

    /// A fixed number of substeps.
    ///
    /// # Errors
    /// When it is outside [`RANGE`](Self::RANGE).
    pub fn fixed(count: u32) -> Result<Self, InvalidValue> {
        Self::Fixed(count).checked()
    }

    /// The number of substeps for a tick of `seconds`.
    pub fn count(&self, seconds: f32) -> u32 {
        let mut count = match *self {
            // Clocks round to nanoseconds: 1/60 s is not exactly six times 1/360 s.
            Self::Auto => (seconds * 360.0 - 1e-3).ceil() as u32,
            Self::Fixed(count) => count,
        };
        Self::RANGE.clamp(&mut count, || 1, &mut Violations::new());
        count
    }
}

impl Ranged for HairSubsteps {
    fn clamp_values(&mut self, violations: &mut Violations) {
        if let Self::Fixed(count) = self {
            Self::RANGE.clamp(count, || 1, violations);
        }
    }
}

/// The substep that is running.
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq)]
pub struct HairStep {
    /// Its length (s).
    pub dt: f32,
    /// Its number within the tick, from 0.
    pub index: u32,
    /// How many the tick has.
    pub count: u32,
}

/// Run condition: in the first substep of a tick.
pub(crate) fn first_substep(step: Res<HairStep>) -> bool {
    step.index == 0
}

/// Run condition: in the substeps of what moves among hair.
pub(crate) fn shared_substep(steps: EffectiveSubsteps) -> bool {
    steps.shared().is_some()
}

/// Run condition: in the last substep of a tick.
pub(crate) fn last_substep(step: Res<HairStep>) -> bool {
    step.index + 1 == step.count
}

/// How many of the tick's substeps a hair takes as one, and with how many iterations at most. A
/// component of a [`Hair`](crate::Hair), written by its level of detail; without it every substep is
/// taken.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct SubstepLimits {
    /// How many substeps are taken as one; 0 counts as 1.
    pub substeps: u32,
    /// The most iterations in each.
    pub iterations: u32,
}

impl Default for SubstepLimits {
    fn default() -> Self {
        Self { substeps: 1, iterations: u32::MAX }
    }
}

/// How many of the tick's substeps the solver of a hair takes as one, unless its level of detail takes
/// more. Chosen once a tick.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub(crate) struct MergedSubsteps(pub(crate) u32);

impl Default for MergedSubsteps {
    fn default() -> Self {
        Self(1)
    }
}

impl MergedSubsteps {
    /// The hair takes no substep.
    pub(crate) const WAITS: Self = Self(u32::MAX);

    /// At most as many as fit into `longest` (s).
    pub(crate) fn within(longest: f32, step: &HairStep) -> Self {
        Self(((longest / step.dt + 1e-3) as u32).clamp(1, step.count.max(1)))
    }
}

/// The effective substep of each hair.
#[derive(SystemParam)]
pub(crate) struct EffectiveSubsteps<'w, 's> {
    step: Res<'w, HairStep>,
    settling: Res<'w, SettleTickHairs>,
    hairs: Query<
        'w,
        's,
        (Option<&'static SubstepLimits>, Option<&'static MergedSubsteps>),
        With<MergedSubsteps>,
    >,
}

/// One hair's substep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EffectiveSubstep {
    /// How long it is (s).
    pub(crate) dt: f32,
    /// Whether it is the hair's first in this tick.
    pub(crate) is_first: bool,
    /// How long the tick is (s).
    pub(crate) tick: f32,
    most_iterations: u32,
}

/// The longest substep of what moves among all hair, such as droplets (s): that of hair by default.
const LONGEST_SHARED: f32 = 1.0 / 180.0;

/// A substep of what moves among all hair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SharedSubstep {
    /// How long it is (s).
    pub(crate) dt: f32,
    /// Whether it is the first in this tick, and the last.
    pub(crate) is_first: bool,
    pub(crate) is_last: bool,
}

impl EffectiveSubsteps<'_, '_> {
    fn together(&self, hair: Entity) -> (u32, SubstepLimits) {
        let (limits, own) = self.hairs.get(hair).unwrap_or_default();
        (Self::longer(limits, own), limits.copied().unwrap_or_default())
    }

    /// Whether the substep that `hair` takes next began before the one that is running.
    pub(crate) fn began_before(&self, hair: Entity) -> bool {
        let HairStep { index, count, .. } = *self.step;
        index > 0 && merged(index - 1, count, self.together(hair).0).is_none()
    }

    /// Whether any hair takes a substep now; others wait until several are merged.
    pub(crate) fn any(&self) -> bool {
        if let Some(hairs) = &self.settling.0 {
            return hairs.iter().any(|hair| self.of(*hair).is_some());
        }
        let HairStep { index, count, .. } = *self.step;
        let takes = |(limits, own): (Option<&SubstepLimits>, Option<&MergedSubsteps>)| {
            merged(index, count, Self::longer(limits, own)).is_some()
        };
        self.hairs.iter().any(takes)
    }

    /// The substep that what moves among all hair takes now: as short as that of any solver. `None` while it waits
    /// for a longer one. Levels of detail do not count, so that no character depends on how far another is.
    pub(crate) fn shared(&self) -> Option<SharedSubstep> {
        let HairStep { dt, index, count } = *self.step;
        let most = MergedSubsteps::within(LONGEST_SHARED, &self.step).0;
        let own = self.hairs.iter().filter_map(|(_, own)| own);
        let substeps = merged(index, count, own.fold(most, |most, own| most.min(own.0)))?;
        let (is_first, is_last) = (index + 1 == substeps, index + 1 == count);
        Some(SharedSubstep { dt: dt * substeps as f32, is_first, is_last })
    }

    fn longer(limits: Option<&SubstepLimits>, own: Option<&MergedSubsteps>) -> u32 {
        let limits = limits.copied().unwrap_or_default();
        limits.substeps.max(own.copied().unwrap_or_default().0)
    }

    /// The substep that `hair` takes now, or `None` while it waits for a longer one.
    pub(crate) fn of(&self, hair: Entity) -> Option<EffectiveSubstep> {
        if self.settling.0.as_ref().is_some_and(|hairs| !hairs.contains(&hair)) {
            return None;
        }
        let HairStep { dt, index, count } = *self.step;
        let (together, limits) = self.together(hair);
        if together == MergedSubsteps::WAITS.0 {
            return None;
        }
        let substeps = merged(index, count, together)?;
        Some(EffectiveSubstep {
            dt: dt * substeps as f32,
            is_first: index + 1 == substeps,
            tick: dt * count as f32,
            most_iterations: limits.iterations,
        })
    }
}

impl EffectiveSubstep {
    /// `full` iterations, limited by the level of detail.
    pub(crate) fn iterations(&self, full: u32) -> u32 {
        self.most_iterations.min(full)
    }
}

/// How many substeps the hair takes as one at the end of substep `index` of `count`, if at most `most`
/// are merged; `None` while it waits. The tick has as few groups as that allows, none longer by more than
/// one substep than another, and none waits beyond it.
fn merged(index: u32, count: u32, most: u32) -> Option<u32> {
    let (done, count) = (u64::from(index) + 1, u64::from(count.max(1)));
    let groups = count.div_ceil(most.max(1).into());
    // Groups end after ⌈k · count / groups⌉ substeps.
    let group = done * groups / count;
    let end = |group: u64| (group * count).div_ceil(groups);
    (end(group) == done).then(|| (done - end(group.saturating_sub(1))) as u32)
}

/// How much faster than in life wetting, drying and the bonds' chemistry
/// ([`HairTreatment`](crate::HairTreatment)) go. A resource, default 1, with the range
/// [`RANGE`](Self::RANGE).
///
/// Hair dries in minutes, players wait seconds. Mechanics are not affected.
#[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq)]
pub struct HairProcessTime(pub f32);

impl Default for HairProcessTime {
    fn default() -> Self {
        Self(1.0)
    }
}

impl HairProcessTime {
    /// Its range.
    pub const RANGE: ValueRange =
        ValueRange::new("HairProcessTime", 0.0..=1e6, "60 makes minutes of seconds")
            .with_safe(1.0..=1000.0);
}

impl Ranged for HairProcessTime {
    fn clamp_values(&mut self, violations: &mut Violations) {
        Self::RANGE.clamp(&mut self.0, || 1.0, violations);
    }
}

/// Runs [`HairTick`] once for each fixed tick.
///
/// By default a tick is noted in [`FixedPostUpdate`], and all that a frame has are run in
/// [`PostUpdate`], after animations and before transforms are propagated: only then is known how heads
/// have moved that are animated from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct TickPlugin {
    schedule: Option<InternedScheduleLabel>,
}

impl TickPlugin {
    /// Ticks at once in `schedule`, with the time that passes there. In a fixed schedule heads that are
    /// animated from frame to frame are then seen a frame late, and unevenly where frames are uneven.
    pub fn new(schedule: impl ScheduleLabel) -> Self {
        Self { schedule: Some(schedule.intern()) }
    }
}

/// Whether a schedule is run by the fixed clock.
pub(crate) fn is_fixed(schedule: InternedScheduleLabel) -> bool {
    [
        FixedMain.intern(),
        FixedFirst.intern(),
        FixedPreUpdate.intern(),
        FixedUpdate.intern(),
        FixedPostUpdate.intern(),
        FixedLast.intern(),
    ]
    .contains(&schedule)
}

impl Plugin for TickPlugin {
    fn build(&self, app: &mut App) {
        fault::plugin(app);
        setting::resource::<HairSubsteps>(app);
        setting::resource::<HairProcessTime>(app);
        let ordered = |schedule: &mut Schedule| {
            schedule.set_executor(SingleThreadedExecutor::new()).set_build_settings(
                ScheduleBuildSettings { ambiguity_detection: LogLevel::Error, ..default() },
            );
            for pair in HairSystems::ALL.windows(2) {
                schedule.configure_sets(pair[0].before(pair[1]));
            }
            for set in HairSystems::ALL {
                for part in set.parts() {
                    schedule.configure_sets(part.in_set(set));
                }
                for pair in set.parts().windows(2) {
                    schedule.configure_sets(pair[0].before(pair[1]));
                }
            }
        };
        app.init_resource::<HairStep>()
            .init_resource::<SettleTickHairs>()
            .init_resource::<WorldMotion>()
            .init_resource::<NotedTicks>()
            .init_schedule(HairTicked)
            .register_type::<HairStep>()
            .register_type::<SubstepLimits>()
            .register_type::<InvalidValue>()
            .edit_schedule(HairFrame, |schedule| {
                schedule.set_executor(SingleThreadedExecutor::new());
            })
            .add_systems(PreUpdate, |world: &mut World| world.run_schedule(HairFrame))
            .edit_schedule(HairTick, ordered)
            .edit_schedule(SettleTick, ordered)
            .add_systems(
                RunFixedMainLoop,
                see_frame
                    .in_set(RunFixedMainLoopSystems::FixedMainLoop)
                    .before(run_fixed_main_schedule),
            );
        // In the same schedule, hair reads the bodies' poses after the physics step.
        let after_physics = |tick: ScheduleConfigs<ScheduleSystem>| {
            #[cfg(feature = "avian")]
            let tick = tick.after(avian3d::prelude::PhysicsSystems::Writeback);
            tick
        };
        match self.schedule {
            Some(schedule) => {
                let alone = !is_fixed(schedule);
                app.insert_resource(OwnSchedule { label: schedule, idle: 0.0 });
                let tick = move |world: &mut World| {
                    note(world, alone);
                    run_noted(world);
                };
                app.add_systems(schedule, after_physics(tick.in_set(HairTicks).into_configs()));
                app.add_systems(HairFrame, |world: &mut World| {
                    let _ = world.run_system_cached_with(close_frame, true);
                    world.resource_mut::<WorldMotion>().end_ticks();
                });
            }
            None => {
                let note = |world: &mut World| {
                    note(world, false);
                    if world.resource::<NotedTicks>().waiting.len() >= MOST_TICKS {
                        report_waiting(world);
                        run_frame(world);
                    }
                };
                app.add_systems(FixedPostUpdate, after_physics(note.into_configs()));
                app.add_systems(
                    PostUpdate,
                    run_frame
                        .in_set(HairTicks)
                        .after(AnimationSystems)
                        .before(TransformSystems::Propagate),
                );
            }
        }
    }
}

/// The plugins that are known to be missing.
#[derive(Resource, Default)]
struct MissingPlugins(HashSet<TypeId>);

/// Whether `Needed` is missing, on which `Own` builds: disabled, or added later. Logged once.
pub(crate) fn lacks<Needed: Plugin, Own: Plugin>(app: &mut App) -> bool {
    let is_missing = !app.is_plugin_added::<Needed>();
    let known = app.world_mut().get_resource_or_init::<MissingPlugins>();
    if is_missing && known.into_inner().0.insert(TypeId::of::<Needed>()) {
        let (needed, own) = (ShortName::of::<Needed>(), ShortName::of::<Own>());
        tracing::warn!(
            "hair: {own} and other plugins do nothing without {needed}: enable it, and add it before them"
        );
    }
    is_missing
}

/// A schedule of the game's own in which ticks run, and for how long it has run none (s).
#[derive(Resource)]
pub(crate) struct OwnSchedule {
    pub(crate) label: InternedScheduleLabel,
    idle: f32,
}

impl OwnSchedule {
    /// For how long it runs none before that is said (s).
    pub(crate) const LONG: f32 = 2.0;

    /// Another `step` (s) has passed without one: whether that is to be said now.
    pub(crate) fn is_idle_for(&mut self, step: f32) -> bool {
        let before = self.idle;
        self.idle += step;
        before < Self::LONG && self.idle >= Self::LONG
    }
}

/// How many ticks may wait to be run.
const MOST_TICKS: usize = 1024;

/// Ticks that are to run, with the clocks that they run by.
#[derive(Resource, Default)]
pub(crate) struct NotedTicks {
    waiting: Vec<(Time, TickMoment)>,
    reported: bool,
}

impl NotedTicks {
    /// How many wait to be run.
    pub(crate) fn waiting(&self) -> usize {
        self.waiting.len()
    }
}

/// Says once that nothing runs the ticks that wait.
fn report_waiting(world: &mut World) {
    if !core::mem::replace(&mut world.resource_mut::<NotedTicks>().reported, true) {
        let message = format!(
            "{MOST_TICKS} fixed ticks ran without PostUpdate, in which hair moves: they were run now; \
             HairPlugins::new(FixedPostUpdate) runs each at once"
        );
        world.write_message(HairFault::new(FaultKind::Setting, message));
    }
}

/// Notes a tick, unless no time passes.
fn note(world: &mut World, alone: bool) {
    let clock = *world.resource::<Time>();
    if clock.delta_secs() <= 0.0 {
        return;
    }
    if let Some(mut own) = world.get_resource_mut::<OwnSchedule>() {
        own.idle = 0.0;
    }
    let _ = world.run_system_cached_with(note_tick, alone);
    let frame = world.get_resource::<Time<Virtual>>();
    let frame = frame.map_or_else(default, |time| [time.delta(), time.elapsed()]);
    let fixed = world.get_resource::<Time<Fixed>>().filter(|_| !alone);
    let rest = fixed.map(Time::<Fixed>::overstep);
    let moment = world.resource_mut::<WorldMotion>().next_tick(clock.delta(), frame, rest);
    world.resource_mut::<NotedTicks>().waiting.push((clock, moment));
}

/// Runs the ticks of a frame, in which all has moved by now.
fn run_frame(world: &mut World) {
    let _ = world.run_system_cached_with(close_frame, false);
    run_noted(world);
    world.resource_mut::<WorldMotion>().end_ticks();
}

/// Runs the noted ticks: as many substeps each as [`HairSubsteps`] gives.
fn run_noted(world: &mut World) {
    let noted = core::mem::take(&mut world.resource_mut::<NotedTicks>().waiting);
    let frame = *world.resource::<Time>();
    for (clock, moment) in noted {
        *world.resource_mut::<Time>() = clock;
        world.resource_mut::<WorldMotion>().begin(moment);
        let seconds = clock.delta_secs();
        let count = world.resource::<HairSubsteps>().count(seconds);
        let dt = seconds / count as f32;
        for index in 0..count {
            *world.resource_mut::<HairStep>() = HairStep { dt, index, count };
            world.run_schedule(HairTick);
        }
        world.run_schedule(HairTicked);
    }
    *world.resource_mut::<Time>() = frame;
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::ecs::system::RunSystemOnce;

    /// `KERATIN_WRITE_DOCS=1 cargo test --lib docs_show` rewrites the table.
    #[test]
    fn docs_show_the_substep_as_it_runs() {
        let mut table = String::from(
            "\n# A substep\n\nEach fixed tick runs these sets of [`HairSystems`] once per substep, one after \
             the other.\n\n| set | part | what it does |\n|---|---|---|\n",
        );
        let link = |set: HairSystems| format!("[`{set:?}`](HairSystems::{set:?})");
        for set in HairSystems::ALL {
            table += &format!("| {} | | {} |\n", link(set), set.description());
            for part in set.parts() {
                table += &format!("| | {} | {} |\n", link(*part), part.description());
            }
        }
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/src/base/guide/substep.md");
        if std::env::var_os("KERATIN_WRITE_DOCS").is_some() {
            std::fs::write(file, &table).unwrap();
        }
        assert_eq!(std::fs::read_to_string(file).unwrap(), table);
    }

    #[test]
    fn auto_substeps_come_near_the_papers_step() {
        for (rate, count) in [(60.0, 6), (120.0, 3), (240.0, 2), (30.0, 12), (64.0, 6), (360.0, 1)]
        {
            assert_eq!(HairSubsteps::Auto.count(1.0 / rate), count, "{rate} Hz");
        }
        assert_eq!(HairSubsteps::Fixed(0).count(0.1), 1);
        assert!(HairSubsteps::fixed(0).is_err());
    }

    /// The lengths of the groups of a tick (substeps).
    fn groups(count: u32, most: u32) -> Vec<u32> {
        (0..count).filter_map(|i| merged(i, count, most)).collect()
    }

    #[test]
    fn as_many_substeps_are_merged_as_fit() {
        let most = |longest, rate: f32, count| {
            let step = HairStep { dt: 1.0 / (rate * count as f32), index: 0, count };
            MergedSubsteps::within(longest, &step).0
        };
        let longest = 1.0 / 180.0;
        for (rate, count, expected) in
            [(60.0, 6, 2), (120.0, 3, 2), (240.0, 2, 2), (30.0, 12, 2), (64.0, 6, 2), (20.0, 1, 1)]
        {
            assert_eq!(most(longest, rate, count), expected, "{rate} Hz, {count} substeps");
        }
        assert_eq!([most(1e-9, 60.0, 6), most(1.0 / 90.0, 60.0, 6), most(9.0, 60.0, 6)], [1, 4, 6]);
    }

    /// At any rate a tick has as many solves as steps of 1/180 s need, which is never more than at a
    /// lower rate: a tick has a whole number of them, so a second has at most one a tick more than 180.
    #[test]
    fn no_tick_has_more_solves_than_one_of_a_lower_rate() {
        let longest = 1.0 / 180.0;
        let mut before = u32::MAX;
        for rate in 10..=240 {
            let seconds = 1.0 / rate as f32;
            let count = HairSubsteps::Auto.count(seconds);
            let step = HairStep { dt: seconds / count as f32, index: 0, count };
            let all = groups(count, MergedSubsteps::within(longest, &step).0);
            let solves = all.len() as u32;
            assert_eq!(solves, 180u32.div_ceil(rate), "{rate} Hz");
            assert!(solves <= before, "{rate} Hz: {solves}, {before} at a lower rate");
            assert!((180..180 + rate).contains(&(solves * rate)), "{rate} Hz: {solves}");
            let longest_taken = *all.iter().max().unwrap() as f32 * step.dt;
            assert!(longest_taken < longest * 1.001, "{rate} Hz: {longest_taken} s");
            before = solves;
        }
    }

    #[test]
    fn what_moves_among_hair_takes_the_shortest_substeps_of_a_solver() {
        let mut world = World::new();
        world.init_resource::<SettleTickHairs>();
        let mut shared = |hairs: &[(u32, u32)]| -> Vec<(f32, bool, bool)> {
            let hairs: Vec<Entity> = (hairs.iter())
                .map(|&(own, substeps)| {
                    let limits = SubstepLimits { substeps, ..default() };
                    world.spawn((MergedSubsteps(own), limits)).id()
                })
                .collect();
            let now = |index| {
                world.insert_resource(HairStep { dt: 1.0 / 360.0, index, count: 6 });
                let shared = |steps: EffectiveSubsteps| steps.shared();
                let SharedSubstep { dt, is_first, is_last } =
                    world.run_system_once(shared).unwrap()?;
                Some(((360.0 * dt).round(), is_first, is_last))
            };
            let all = (0..6).filter_map(now).collect();
            hairs.into_iter().for_each(|hair| assert!(world.despawn(hair)));
            all
        };
        let pairs = [(2.0, true, false), (2.0, false, false), (2.0, false, true)];
        assert_eq!(shared(&[]), pairs);
        assert_eq!(shared(&[(2, 6), (MergedSubsteps::WAITS.0, 1)]), pairs, "details do not count");
        assert_eq!(shared(&[(2, 1), (1, 1)]).len(), 6);
    }

    #[test]
    fn merged_substeps_are_few_and_alike_and_sum_to_the_tick() {
        for count in 1..40 {
            for most in 0..9 {
                let all = groups(count, most);
                assert_eq!(all.iter().sum::<u32>(), count);
                assert_eq!(all.len() as u32, count.div_ceil(most.max(1)));
                let (least, longest) = (all.iter().min().unwrap(), all.iter().max().unwrap());
                assert!(longest - least <= 1 && *longest <= most.max(1), "{all:?}");
                assert!(merged(count - 1, count, most).is_some(), "nothing waits beyond the tick");
            }
        }
        let six: Vec<_> = (0..6).map(|i| merged(i, 6, 2)).collect();
        assert_eq!(six, [None, Some(2), None, Some(2), None, Some(2)]);
        assert_eq!(
            [groups(5, 2), groups(6, 4), groups(3, 2)],
            [vec![2, 2, 1], vec![3, 3], vec![2, 1]]
        );
        assert_eq!(merged(u32::MAX - 1, u32::MAX, u32::MAX), Some(u32::MAX));
    }
}
