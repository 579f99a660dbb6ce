//! Transport of a strand's water in a tick: flow along it, soaking, drying and drips.

use super::super::{
    droplet::Droplet,
    model::{WATER_VISCOSITY, clinging, hanging},
};
use super::{AFTER_DRIP, HairWetting, Moisture, node_lengths, sheen};
use crate::forces::environment::vapour::{DryingAir, WATER, transfer};
use bevy::{math::ops::exp_m1, prelude::*};
use core::f32::consts::PI;

/// Courant number of the film's flow: how far it moves in one round, as a share of a segment.
const COURANT: f32 = 0.4;

/// Rounds of flow in a step, at most: more only where a film is so thick that most of it drips off.
const MOST_ROUNDS: f32 = 6.0;

/// Exposure of a node to moving air in a step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Exposure {
    /// Speed of the air beyond the room's draught (m/s).
    pub speed: f32,
    /// Its temperature above the room's (K).
    pub warmth: f32,
    /// Share of the node's capacity that equation 19 dries away in this step: Σ drying |Δv_w|.
    pub blown: f32,
    /// Whether it is submerged instead: it soaks, and has no film.
    pub submerged: bool,
}

impl Exposure {
    pub fn is_finite(&self) -> bool {
        self.speed.is_finite() && self.warmth.is_finite() && self.blown.is_finite()
    }
}

/// Conditions of a step for the water of all strands of a hair, computed once.
#[derive(Clone, Debug)]
pub(crate) struct WaterConditions<'a> {
    wetting: HairWetting,
    gravity: Vec3,
    air: &'a DryingAir,
    /// Time for chemistry and evaporation (s).
    process: f32,
    dt: f32,
    diameter: f32,
    /// Capacity for bound water per metre of strand (m³/m).
    capacity: f64,
    /// Share of the free capacity that soaking fills in this step.
    soaked: f64,
    /// Film capacity of a node and of a tip (m³).
    held: f64,
    hung: f64,
    /// Evaporation into still room air per metre of strand (m³/m).
    still: f64,
}

impl<'a> WaterConditions<'a> {
    /// For a hair with this `wetting`, under `gravity` in its frame (m/s²), in a room's `air`, in a
    /// step of `dt` (s) in which chemistry is `process` times as fast as in reality.
    pub fn new(
        wetting: HairWetting,
        gravity: Vec3,
        air: &'a DryingAir,
        dt: f32,
        process: f32,
    ) -> Self {
        let (bundle, g) = (wetting.bundle(1.0), gravity.length());
        let mut conditions = Self {
            gravity,
            air,
            process: process * dt,
            dt,
            diameter: 2.0 * wetting.lock_radius(),
            capacity: wetting.capacity(),
            soaked: f64::from(1.0 - bevy::math::ops::exp(-wetting.soaking * process * dt)),
            held: clinging(bundle, g),
            hung: hanging(bundle, g),
            still: 0.0,
            wetting,
        };
        conditions.still = conditions.drying(&Exposure::default());
        conditions
    }

    /// Evaporation per metre of strand in this step (m³/m).
    fn drying(&self, exposed: &Exposure) -> f64 {
        let speed = self.air.draught + exposed.speed;
        let drive = self.air.drive(exposed.warmth) * self.wetting.evaporation;
        let flux = transfer(speed, self.diameter) * drive;
        f64::from(flux * PI * self.diameter * self.process) / WATER
    }

    /// How far a film (m³) on a segment flows in this step where gravity along it is `along` (m/s²), and how far it
    /// creeps, as shares of its length.
    fn courant(&self, film: f64, along: f32, length: f32) -> [f32; 2] {
        const THINNING: f32 = WATER as f32 / (3.0 * WATER_VISCOSITY);
        let thickness = film as f32 / (PI * self.diameter * length);
        let speed = along.abs() * thickness * thickness * THINNING;
        [speed * self.dt / length, self.wetting.wicking * self.process / (length * length)]
    }
}

/// Water that a strand lost in a step.
#[derive(Clone, Debug, Default)]
pub(crate) struct WaterLoss {
    /// Evaporated (m³); negative in damp air.
    pub evaporated: f64,
    /// Given to the surrounding water (m³); negative where hair absorbed it.
    pub merged: f64,
    /// Node and volume (m³) of drops that detach.
    pub drips: Vec<(usize, f64)>,
}

impl Moisture {
    /// One step of the water of a strand with nodes at `positions` and segments of rest `lengths`
    /// (m): the film flows and creeps, soaks in, dries and drips. `exposure` is `None` in still
    /// air. The arrays must have an element for each node.
    pub(crate) fn exchange(
        &mut self,
        positions: &[Vec3],
        lengths: &[f32],
        conditions: &WaterConditions<'_>,
        exposure: impl Fn(usize) -> Option<Exposure>,
        loss: &mut WaterLoss,
    ) {
        self.flow(positions, lengths, conditions);
        let last = lengths.len();
        let damp = conditions.air.equilibrium > 0.0;
        for (i, length) in node_lengths(lengths).enumerate() {
            let (film, bound) = (&mut self.film[i], &mut self.bound[i]);
            let exposed = exposure(i);
            if exposed.is_some_and(|e| e.submerged) {
                let capacity = conditions.capacity * f64::from(length);
                let soaks = (capacity - *bound) * conditions.soaked;
                loss.merged += *film - soaks;
                *film = 0.0;
                *bound += soaks;
                self.wetness[i] = ((*bound / capacity) as f32).clamp(0.0, 1.0);
                self.sheen[i] = 1.0;
                continue;
            }
            if *film == 0.0 && *bound == 0.0 && !damp {
                (self.wetness[i], self.sheen[i]) = (0.0, 0.0);
                continue;
            }
            let length = f64::from(length);
            let capacity = conditions.capacity * length;
            let of_capacity = capacity.recip();
            // Exceeds capacity only after settings changed: the excess returns to the film.
            let soaks = ((capacity - *bound) * conditions.soaked)
                .min(*film)
                .max((capacity - *bound).min(0.0));
            *film -= soaks;
            *bound += soaks;

            let blown = exposed.map_or(0.0, |e| capacity * f64::from(e.blown));
            let drying = length * exposed.map_or(conditions.still, |e| conditions.drying(&e));
            let from_film = (drying + blown).min(*film);
            *film -= from_film;
            // Bound water evaporates more slowly the less of it there is; in damp air hair absorbs
            // vapour.
            let share = (*bound * of_capacity) as f32;
            let equilibrium = conditions.air.equilibrium;
            let excess = f64::from((share - equilibrium) / (1.0 - equilibrium).max(1e-3));
            let rest = (drying + blown - from_film).max(0.0);
            let warm = if rest > 0.0 { drying.min(rest) } else { 0.0 };
            let wanted = warm * excess + (rest - warm);
            let from_bound = wanted.min(*bound).max(*bound - capacity);
            *bound -= from_bound;
            loss.evaporated += from_film + from_bound;
            self.wetness[i] = ((*bound * of_capacity) as f32).clamp(0.0, 1.0);

            let limit = if i == last { conditions.hung } else { conditions.held };
            if *film > limit {
                // A drop at the tip takes most of the film; elsewhere only the excess drips.
                let drop = if i == last { 0.8 * *film } else { *film - AFTER_DRIP * limit };
                // The rest of a film that no drop can hold follows in the next steps.
                let drop = drop.min(f64::from(*Droplet::VOLUME.valid.end()));
                *film -= drop;
                loss.drips.push((i, drop));
            }
            self.sheen[i] = sheen(*film, self.wetness[i], conditions.held);
        }
    }

    /// A step of hair without a film: bound water goes toward the air's equilibrium, exactly in a step of
    /// any length. Returns the largest change of wetness. The arrays must have an element for each node.
    pub(crate) fn equilibrate(
        &mut self,
        lengths: &[f32],
        conditions: &WaterConditions<'_>,
        exposure: impl Fn(usize) -> Option<Exposure>,
        loss: &mut WaterLoss,
    ) -> f32 {
        let equilibrium = conditions.air.equilibrium;
        let per_drying = conditions.capacity * f64::from((1.0 - equilibrium).max(1e-3));
        let share = |drying: f64| f64::from(-exp_m1(-(drying / per_drying) as f32));
        let (still, mut moved) = (share(conditions.still), 0.0_f32);
        for (i, length) in node_lengths(lengths).enumerate() {
            let capacity = conditions.capacity * f64::from(length);
            let share = exposure(i).map_or(still, |exposed| share(conditions.drying(&exposed)));
            let lost = (self.bound[i] - capacity * f64::from(equilibrium)) * share;
            self.bound[i] -= lost;
            loss.evaporated += lost;
            let wetness = ((self.bound[i] / capacity) as f32).clamp(0.0, 1.0);
            moved = moved.max((wetness - self.wetness[i]).abs());
            (self.wetness[i], self.sheen[i]) = (wetness, wetness);
        }
        moved
    }

    /// The film flows along each segment under gravity and spreads by wicking, in as many rounds as it takes to
    /// resolve that.
    fn flow(&mut self, positions: &[Vec3], lengths: &[f32], conditions: &WaterConditions<'_>) {
        let gravity = conditions.gravity.length();
        let segments = lengths.iter().zip(self.film.windows(2));
        let fastest = segments.fold(0.0_f32, |fastest, (length, film)| {
            let [flows, creeps] = conditions.courant(film[0].max(film[1]), gravity, *length);
            fastest.max(flows / COURANT).max(creeps / (0.5 * COURANT))
        });
        let rounds = fastest.ceil().clamp(1.0, MOST_ROUNDS);
        for _ in 0..rounds as u32 {
            self.flow_by(positions, lengths, conditions, rounds.recip());
        }
    }

    /// The same for a share of the step.
    fn flow_by(
        &mut self,
        positions: &[Vec3],
        lengths: &[f32],
        conditions: &WaterConditions<'_>,
        share: f32,
    ) {
        let mut inflow = 0.0;
        for (i, &length) in lengths.iter().enumerate() {
            let (above, below) = (self.film[i], self.film[i + 1]);
            if above == 0.0 && below == 0.0 && inflow == 0.0 {
                continue;
            }
            let edge = positions[i + 1] - positions[i];
            let along = edge.normalize_or_zero().dot(conditions.gravity);
            let source = if along >= 0.0 { above } else { below };
            let [flows, creeps] = conditions.courant(source, along, length);
            let flowing = f64::from((flows * share).min(COURANT)) * source;
            let creeping = (above - below) * f64::from((creeps * share).min(0.5 * COURANT));
            let crossing = flowing.copysign(f64::from(along)) + creeping;
            // Limits the flow so that no film becomes negative.
            let crossing = crossing.clamp(-0.5 * below, 0.5 * above);
            self.film[i] += inflow - crossing;
            inflow = crossing;
        }
        if let Some(tip) = self.film.last_mut() {
            *tip += inflow;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn still() -> DryingAir {
        DryingAir::new(22.0, 0.5, 0.1)
    }

    fn hanging_strand(n: usize) -> (Vec<Vec3>, Vec<f32>) {
        ((0..=n).map(|i| Vec3::NEG_Y * 0.03 * i as f32).collect(), vec![0.03; n])
    }

    fn conditions(wetting: HairWetting, air: &DryingAir, process: f32) -> WaterConditions<'_> {
        WaterConditions::new(wetting, Vec3::NEG_Y * 9.8, air, 1.0 / 360.0, process)
    }

    #[test]
    fn the_film_runs_down_and_drips() {
        let strand = hanging_strand(8);
        let (wetting, air) = (HairWetting { soaking: 0.0, evaporation: 0.0, ..default() }, still());
        let conditions = conditions(wetting, &air, 1.0);
        let mut m = Moisture::default();
        m.fit(9);
        m.add_film(1, 15e-9);
        let mut loss = WaterLoss::default();
        // A film is the slower the thinner it is.
        let mut middle = 1.0;
        for seconds in [1, 4, 15] {
            for _ in 0..360 * seconds {
                m.exchange(&strand.0, &strand.1, &conditions, |_| None, &mut loss);
            }
            let moment: f64 = m.film().iter().enumerate().map(|(i, f)| i as f64 * f).sum();
            let lower = moment / m.film().iter().sum::<f64>();
            assert!(lower > middle + 0.1 && loss.drips.is_empty(), "{lower}");
            middle = lower;
        }
        for _ in 0..20 {
            (1..9).for_each(|node| m.add_film(node, 2e-9));
            for _ in 0..360 {
                m.exchange(&strand.0, &strand.1, &conditions, |_| None, &mut loss);
            }
        }
        assert!(loss.drips.iter().any(|(node, _)| *node == 8), "{:?}", loss.drips);
        let dripped: f64 = loss.drips.iter().map(|d| d.1).sum();
        let total = m.volume() + dripped;
        assert!((total - 335e-9).abs() < 1e-18, "{total}");
    }

    /// A tip holds 1.2 times as much as a node within the strand, and loses most of it at once.
    #[test]
    fn drops_leave_where_there_is_more_than_holds() {
        let (points, lengths) = hanging_strand(4);
        let wetting = HairWetting { soaking: 0.0, evaporation: 0.0, wicking: 0.0, ..default() };
        let air = still();
        let conditions = WaterConditions::new(wetting, Vec3::ZERO, &air, 1.0 / 360.0, 1.0);
        assert!((conditions.hung / conditions.held - 1.2).abs() < 1e-6);
        for (share, drips) in [(0.99, vec![]), (1.1, vec![2]), (1.3, vec![2, 4])] {
            let film = share * conditions.held;
            let mut m = Moisture::default();
            m.fit(5);
            m.add_film(2, film);
            m.add_film(4, film);
            let mut loss = WaterLoss::default();
            m.exchange(&points, &lengths, &conditions, |_| None, &mut loss);
            assert_eq!(loss.drips.iter().map(|drip| drip.0).collect::<Vec<_>>(), drips);
            for (node, volume) in loss.drips {
                let left = if node == 4 { 0.2 * film } else { AFTER_DRIP * conditions.held };
                assert!((m.film()[node] / left - 1.0).abs() < 1e-6, "node {node}");
                assert!((volume + m.film()[node] - film).abs() < 1e-18);
            }
        }
    }

    #[test]
    fn drying_in_the_papers_limit_is_equation_19() {
        // Soaked through, no drying but the wind's, no film: dw = −0.3 |Δv_w|.
        let strand = hanging_strand(4);
        let (wetting, air) = (HairWetting { evaporation: 0.0, ..default() }, still());
        let conditions = conditions(wetting, &air, 1.0);
        let mut m = Moisture::default();
        m.fit(5);
        m.soak(1.0, 0.0, node_lengths(&strand.1).map(|l| wetting.capacity() * f64::from(l)));
        for _ in 0..100 {
            let blown = |i: usize| Some(Exposure { blown: 0.3 * 0.004 * i as f32, ..default() });
            m.exchange(&strand.0, &strand.1, &conditions, blown, &mut WaterLoss::default());
        }
        for (i, wet) in m.wetness().iter().enumerate() {
            assert!((wet - (1.0 - 0.12 * i as f32)).abs() < 1e-5, "{i}: {wet}");
        }
    }

    /// The rate from tables: 22 °C, half of saturated vapour, wet bulb 15.4 °C, a draught of 0.1 m/s across
    /// the lock, Sherwood's number by Churchill and Bernstein.
    #[test]
    fn still_air_dries_film_first_and_then_bound_water_at_the_rate_of_the_tables() {
        let (points, lengths) = hanging_strand(4);
        let wetting = HairWetting { soaking: 0.0, wicking: 0.0, ..default() };
        let (air, diameter) = (still(), 2.0 * f64::from(wetting.lock_radius()));
        let (schmidt, reynolds) = (1.5e-5 / 2.6e-5_f64, 0.1 * diameter / 1.5e-5);
        let sherwood = 0.3
            + 0.62 * reynolds.sqrt() * schmidt.cbrt()
                / (1.0 + (0.4 / schmidt).powf(2.0 / 3.0)).powf(0.25);
        // m³ of water a metre and second, of g/m³ of vapour.
        let rate = |vapour: f64| core::f64::consts::PI * sherwood * 2.6e-5 * vapour * 1e-6;
        let tables = rate(13.1 - 9.7);
        let rate = rate(1e3 * f64::from(air.drive(0.0)));
        assert!((rate / tables - 1.0).abs() < 0.12, "{rate} m²/s, by tables {tables}");
        // 100 seconds in 360 substeps.
        let conditions = WaterConditions::new(wetting, Vec3::ZERO, &air, 1.0 / 360.0, 100.0);
        let (seconds, capacity) = (100.0, wetting.capacity());
        let mut m = Moisture::default();
        m.fit(5);
        m.soak(1.0, 5e-9, node_lengths(&lengths).map(|l| capacity * f64::from(l)));
        let run = |m: &mut Moisture| {
            let mut loss = WaterLoss::default();
            (0..360).for_each(|_| m.exchange(&points, &lengths, &conditions, |_| None, &mut loss));
            assert!(loss.drips.is_empty());
            loss.evaporated
        };
        let lost = run(&mut m);
        assert!((lost / (rate * 0.12 * seconds) - 1.0).abs() < 0.01, "{lost} m³ of film");
        for (i, (film, length)) in m.film().iter().zip(node_lengths(&lengths)).enumerate() {
            let expected = 5e-9 - rate * f64::from(length) * seconds;
            assert!((film - expected).abs() < 1e-11, "node {i}: {film}, expected {expected}");
        }
        assert!(m.wetness().iter().all(|wet| (wet - 1.0).abs() < 1e-6), "bound water waits");
        // Bound water goes the slower the less there is.
        m.film.fill(0.0);
        run(&mut m);
        let expected = (-rate * seconds / capacity).exp() as f32;
        assert!(expected < 0.95, "{expected}");
        assert!(m.wetness().iter().all(|wet| (wet - expected).abs() < 1e-3), "{:?}", m.wetness());
    }

    /// One long step is as many short ones, and those are what the exchange does without a film.
    #[test]
    fn a_step_to_equilibrium_is_exact_however_long() {
        let (points, lengths) = hanging_strand(4);
        let (wetting, air) = (HairWetting::default(), DryingAir::new(22.0, 0.8, 0.1));
        let soaked = |share: f32| {
            let mut m = Moisture::default();
            m.fit(5);
            m.soak(share, 0.0, node_lengths(&lengths).map(|l| wetting.capacity() * f64::from(l)));
            m
        };
        let step = |seconds| WaterConditions::new(wetting, Vec3::ZERO, &air, 1.0, seconds);
        for share in [0.0, 1.0] {
            let [mut long, mut short, mut fine] = [0; 3].map(|_| soaked(share));
            let [mut long_loss, mut loss] = [0; 2].map(|_| WaterLoss::default());
            let moved = long.equilibrate(&lengths, &step(1000.0), |_| None, &mut long_loss);
            for _ in 0..1000 {
                short.equilibrate(&lengths, &step(1.0), |_| None, &mut loss);
                fine.exchange(&points, &lengths, &step(1.0), |_| None, &mut default());
            }
            let w = [&long, &short, &fine].map(|m| m.wetness()[2]);
            assert!((w[0] - w[1]).abs() < 1e-4 && (w[0] - w[2]).abs() < 2e-3, "{w:?}");
            assert!((moved - (w[0] - share).abs()).abs() < 1e-6 && moved > 0.02, "{moved}");
            assert!((long.volume() + long_loss.evaporated - soaked(share).volume()).abs() < 1e-18);
            long.equilibrate(&lengths, &step(1e9), |_| None, &mut long_loss);
            assert!((long.wetness()[0] - air.equilibrium).abs() < 1e-6);
        }
        // In saturated air as well.
        let (fog, mut m) = (DryingAir::new(22.0, 1.0, 0.1), soaked(0.0));
        let step = WaterConditions::new(wetting, Vec3::ZERO, &fog, 1.0, 1e5);
        m.equilibrate(&lengths, &step, |_| None, &mut default());
        assert!(m.wetness()[2] > 0.95, "{}", m.wetness()[2]);
    }

    #[test]
    fn damp_air_wets_and_a_room_dries() {
        let strand = hanging_strand(4);
        let wetting = HairWetting::default();
        let damp = DryingAir::new(22.0, 0.9, 0.1);
        let mut m = Moisture::default();
        m.fit(5);
        let mut loss = WaterLoss::default();
        let run = |m: &mut Moisture, air: &DryingAir, loss: &mut WaterLoss| {
            let conditions = conditions(wetting, air, 3600.0);
            for _ in 0..3600 {
                m.exchange(&strand.0, &strand.1, &conditions, |_| None, loss);
            }
        };
        run(&mut m, &damp, &mut loss);
        assert!(loss.evaporated < 0.0);
        assert!((m.wetness()[2] - damp.equilibrium).abs() < 0.02, "{}", m.wetness()[2]);
        run(&mut m, &still(), &mut loss);
        assert!(m.wetness()[2] < 0.02);
        assert!((m.volume() + loss.evaporated).abs() < 1e-18);
    }

    proptest! {
        #[test]
        fn water_is_neither_made_nor_lost_nor_negative(
            film in proptest::collection::vec(0.0f64..60e-9, 9),
            share in 0.0f32..1.0,
            points in proptest::collection::vec((-1.0f32..1.0, -1.0f32..1.0), 9),
            process in 0.0f32..1e4,
            dt in 1e-4f32..0.1,
        ) {
            let strand = hanging_strand(8);
            let (wetting, air) = (HairWetting::default(), still());
            let positions: Vec<Vec3> =
                points.iter().map(|(x, y)| Vec3::new(*x, *y, 0.0) * 0.1).collect();
            let conditions = WaterConditions::new(wetting, Vec3::NEG_Y * 9.8, &air, dt, process);
            let mut m = Moisture::default();
            m.fit(9);
            m.soak(share, 0.0, node_lengths(&strand.1).map(|l| wetting.capacity() * f64::from(l)));
            film.iter().enumerate().for_each(|(i, f)| m.add_film(i, *f));
            let before = m.volume();
            let mut loss = WaterLoss::default();
            for _ in 0..50 {
                let exposed = |_| Some(Exposure { speed: 3.0, warmth: 40.0, blown: 0.001, submerged: false });
                m.exchange(&positions, &strand.1, &conditions, exposed, &mut loss);
                prop_assert!(m.film().iter().chain(m.bound()).all(|v| *v >= 0.0 && v.is_finite()));
                prop_assert!(m.wetness().iter().all(|w| (0.0..=1.0).contains(w)));
            }
            let dripped: f64 = loss.drips.iter().map(|d| d.1).sum();
            let after = m.volume() + loss.evaporated + dripped;
            prop_assert!((after - before).abs() < 1e-12 * before.max(1e-12));
        }
    }

    #[test]
    fn a_film_that_no_drop_can_hold_leaves_in_several() {
        let strand = hanging_strand(4);
        let (wetting, air) = (HairWetting { soaking: 0.0, evaporation: 0.0, ..default() }, still());
        let conditions = conditions(wetting, &air, 1.0);
        let mut m = Moisture::default();
        m.fit(5);
        m.add_film(2, 5e-3);
        m.add_film(4, 5e-3);
        let mut loss = WaterLoss::default();
        (0..60).for_each(|_| m.exchange(&strand.0, &strand.1, &conditions, |_| None, &mut loss));
        assert!(loss.drips.len() >= 10, "{:?}", loss.drips);
        assert!(loss.drips.iter().all(|(_, volume)| Droplet::VOLUME.check(*volume).is_ok()));
        let dripped: f64 = loss.drips.iter().map(|d| d.1).sum();
        assert!((dripped + m.volume() - 10e-3).abs() < 1e-15 && m.volume() < 1e-3, "{dripped}");
    }

    #[test]
    fn films_flow_the_same_way_whichever_end_is_the_root() {
        let (wetting, air) = (HairWetting { soaking: 0.0, evaporation: 0.0, ..default() }, still());
        let conditions = conditions(wetting, &air, 1.0);
        let lengths: Vec<f32> = (0..8).map(|i| 0.02 + 0.003 * i as f32).collect();
        // Up and down, so that films run to and fro.
        let mut points = vec![Vec3::ZERO];
        for (i, l) in lengths.iter().enumerate() {
            let slope = Vec3::new(1.0, [-1.0, 0.5, -0.3][i % 3], 0.0).normalize();
            points.push(points[i] + slope * *l);
        }
        let back = |v: &[f32]| v.iter().rev().copied().collect::<Vec<_>>();
        let turned: Vec<Vec3> = points.iter().rev().copied().collect();
        let [mut forth, mut reverse] = [Moisture::default(), Moisture::default()];
        [&mut forth, &mut reverse].into_iter().for_each(|m| _ = m.fit(9));
        for i in 0..9 {
            let film = 1e-9 * (1.0 + (i * 5 % 7) as f64);
            forth.add_film(i, film);
            reverse.add_film(8 - i, film);
        }
        let energy = |m: &Moisture| -> f64 {
            m.film().iter().zip(&points).map(|(film, p)| film * f64::from(p.y)).sum()
        };
        let before = energy(&forth);
        for _ in 0..90 {
            forth.flow(&points, &lengths, &conditions);
            reverse.flow(&turned, &back(&lengths), &conditions);
        }
        for (i, (a, b)) in forth.film().iter().zip(reverse.film().iter().rev()).enumerate() {
            assert!((a - b).abs() < 1e-15, "node {i}: {a} and {b}");
        }
        assert!(energy(&forth) < before, "down on the whole");
    }
}
