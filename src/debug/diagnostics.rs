//! Entries of Bevy's `DiagnosticsStore`.

use super::Owners;
use crate::{
    base::schedule::{HairStep, HairSystems, HairTick, last_substep},
    hair::strand::{StrandOf, StrandSleep},
};
use bevy::{
    diagnostic::{Diagnostic, DiagnosticPath, Diagnostics, RegisterDiagnostic},
    platform::time::Instant,
    prelude::*,
};
use core::time::Duration;

/// Measures hair for Bevy's `DiagnosticsStore`: how many strands are moved by what, once a frame, and
/// the time that each stage of a tick takes, once a tick. Shown by Bevy's `LogDiagnosticsPlugin`, or by
/// whatever reads the store.
///
/// | path | unit | what |
/// |---|---|---|
/// | `hair/strands/…` | strands | how many are moved by what; each strand is counted once |
/// | `hair/tick` | ms | one tick, all substeps |
/// | `hair/tick/…` | ms | the part of it in each set of [`HairSystems`] |
#[derive(Clone, Copy, Debug, Default)]
pub struct HairDiagnosticsPlugin;

impl HairDiagnosticsPlugin {
    /// Strands that the CPU simulates.
    pub const SIMULATED: DiagnosticPath = DiagnosticPath::const_new("hair/strands/simulated");
    /// Strands at rest that are not simulated, see [`SleepSettings`](crate::SleepSettings).
    pub const ASLEEP: DiagnosticPath = DiagnosticPath::const_new("hair/strands/asleep");
    /// Strands that follow simulated ones, see [`LodLevel::strands`](crate::LodLevel::strands).
    pub const FOLLOWERS: DiagnosticPath = DiagnosticPath::const_new("hair/strands/followers");
    /// Strands of hair whose level of detail simulates none.
    pub const FROZEN: DiagnosticPath = DiagnosticPath::const_new("hair/strands/frozen");
    /// Strands of hair that is simulated on the GPU.
    pub const GPU: DiagnosticPath = DiagnosticPath::const_new("hair/strands/gpu");
    /// Strands of hair that is simulated ahead before it is first drawn, see
    /// [`Settling`](crate::Settling).
    pub const SETTLING: DiagnosticPath = DiagnosticPath::const_new("hair/strands/settling");
    /// Time of a tick (ms). Hair that settles is not in it.
    pub const TICK: DiagnosticPath = DiagnosticPath::const_new("hair/tick");
    /// Time of each set of a tick (ms), in the order of [`HairSystems::ALL`].
    pub const STAGES: [DiagnosticPath; HairSystems::ALL.len()] = [
        DiagnosticPath::const_new("hair/tick/first"),
        DiagnosticPath::const_new("hair/tick/roots"),
        DiagnosticPath::const_new("hair/tick/external_forces"),
        DiagnosticPath::const_new("hair/tick/interaction"),
        DiagnosticPath::const_new("hair/tick/rest_shape"),
        DiagnosticPath::const_new("hair/tick/projection"),
        DiagnosticPath::const_new("hair/tick/bond_update"),
        DiagnosticPath::const_new("hair/tick/last"),
    ];

    /// In the order of `Owner`.
    const STRANDS: [DiagnosticPath; STRAND_KINDS] =
        [Self::SIMULATED, Self::ASLEEP, Self::FOLLOWERS, Self::FROZEN, Self::GPU, Self::SETTLING];
}

impl Plugin for HairDiagnosticsPlugin {
    fn build(&self, app: &mut App) {
        for path in Self::STRANDS {
            app.register_diagnostic(Diagnostic::new(path).with_suffix(" strands"));
        }
        for path in [Self::TICK].into_iter().chain(Self::STAGES) {
            app.register_diagnostic(Diagnostic::new(path).with_suffix("ms"));
        }
        app.init_resource::<StageTimes>().add_systems(Update, count_strands);
        let all = HairSystems::ALL;
        app.add_systems(HairTick, begin.before(all[0]).ambiguous_with_all());
        for (stage, set) in all.into_iter().enumerate() {
            let lap = move |mut times: ResMut<StageTimes>| times.lap(stage);
            match all.get(stage + 1) {
                Some(next) => app.add_systems(HairTick, lap.after(set).before(*next)),
                None => {
                    let last = (lap, report.run_if(last_substep)).chain();
                    app.add_systems(HairTick, last.after(set))
                }
            };
        }
    }
}

/// How many kinds of `Owner` there are.
const STRAND_KINDS: usize = 6;

fn count_strands(
    strands: Query<(&StrandOf, &StrandSleep)>,
    owners: Owners,
    mut diagnostics: Diagnostics,
) {
    let mut counts = [0_usize; STRAND_KINDS];
    for (of, sleep) in &strands {
        counts[owners.of(of, sleep) as usize] += 1;
    }
    for (path, count) in HairDiagnosticsPlugin::STRANDS.iter().zip(counts) {
        diagnostics.add_measurement(path, || count as f64);
    }
}

/// How long the stages of this tick have taken so far.
#[derive(Resource, Debug)]
struct StageTimes {
    since: Instant,
    spent: [Duration; HairSystems::ALL.len()],
}

impl Default for StageTimes {
    fn default() -> Self {
        Self { since: Instant::now(), spent: Default::default() }
    }
}

impl StageTimes {
    fn lap(&mut self, stage: usize) {
        let now = Instant::now();
        self.spent[stage] += now - core::mem::replace(&mut self.since, now);
    }
}

fn begin(mut times: ResMut<StageTimes>, step: Res<HairStep>) {
    if step.index == 0 {
        *times = StageTimes::default();
    }
    times.since = Instant::now();
}

fn report(times: Res<StageTimes>, mut diagnostics: Diagnostics) {
    let milliseconds = times.spent.map(|spent| 1e3 * spent.as_secs_f64());
    diagnostics.add_measurement(&HairDiagnosticsPlugin::TICK, || milliseconds.iter().sum());
    for (path, milliseconds) in HairDiagnosticsPlugin::STAGES.iter().zip(milliseconds) {
        diagnostics.add_measurement(path, || milliseconds);
    }
}

#[cfg(test)]
mod tests {
    use super::{super::Owner, *};
    use crate::{prelude::*, run_ticks};
    use bevy::diagnostic::DiagnosticsStore;

    fn grow(app: &mut App, kind: impl Bundle, strands: usize) -> Entity {
        let hair = app.world_mut().spawn((Hair, kind)).id();
        for i in 0..strands {
            let points = [0.0, 0.05, 0.1].map(|y| Vec3::new(0.01 * i as f32, -y, 0.0));
            let strand = Strand::from_polyline(&points).unwrap();
            app.world_mut().spawn((StrandOf(hair), strand));
        }
        hair
    }

    fn value(app: &App, path: &DiagnosticPath) -> Option<f64> {
        app.world().resource::<DiagnosticsStore>().get(path).unwrap().value()
    }

    #[test]
    fn each_strand_is_counted_by_what_moves_it() {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, HairPlugins::default(), HairDiagnosticsPlugin));
        let level = |strands| {
            let level = crate::LodLevel { below: 10.0, strands, ..default() };
            (SleepSettings::never(), HairLod { levels: vec![level], ..default() })
        };
        grow(&mut app, SleepSettings::never(), 2);
        grow(&mut app, SleepSettings { seconds: 0.2, ..default() }, 3);
        grow(&mut app, level(0.25), 8);
        grow(&mut app, level(0.0), 5);
        let forever = SettleSettings { ticks: 10_000, speed: 0.0, ..default() };
        grow(&mut app, (Settling::default(), forever), 7);
        run_ticks(&mut app, 60);
        #[cfg_attr(not(feature = "gpu"), allow(unused_mut, reason = "no GPU"))]
        let mut expected = [2.0 + 2.0, 3.0, 6.0, 5.0, 0.0, 7.0];
        let counts = |app: &App| {
            HairDiagnosticsPlugin::STRANDS.map(|path| value(app, &path).unwrap_or(f64::NAN))
        };
        assert_eq!(counts(&app), expected);

        #[cfg(feature = "gpu")]
        {
            let mut app = App::new();
            app.add_plugins((MinimalPlugins, HairDiagnosticsPlugin));
            grow(&mut app, (crate::OnGpu::HANDED_OVER, MotionOwner::Gpu), 4);
            app.update();
            expected = [0.0; 6];
            expected[Owner::Gpu as usize] = 4.0;
            assert_eq!(counts(&app), expected);
        }
    }

    #[test]
    fn stages_of_a_tick_are_timed_each_on_its_own() {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, HairPlugins::default(), HairDiagnosticsPlugin));
        app.insert_resource(HairSubsteps::Fixed(2));
        grow(&mut app, (), 1);
        run_ticks(&mut app, 1);
        app.add_systems(
            HairTick,
            (|| std::thread::sleep(Duration::from_millis(4))).in_set(HairSystems::RestShape),
        );
        run_ticks(&mut app, 2);
        let stages = HairDiagnosticsPlugin::STAGES.map(|path| value(&app, &path).unwrap());
        let tick = value(&app, &HairDiagnosticsPlugin::TICK).unwrap();
        assert!(stages[4] >= 8.0, "two substeps: {stages:?}");
        assert!((tick - stages.iter().sum::<f64>()).abs() < 1e-9);
        assert!(stages.iter().all(|stage| *stage > 0.0), "{stages:?}");
        // Not the time between ticks, nor that of its neighbours.
        assert!(stages[3] < 8.0 && stages[5] < 8.0, "{stages:?}");
    }
}
