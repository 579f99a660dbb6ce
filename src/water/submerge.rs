//! `ExternalForces`: effects of a [`WaterVolume`](super::WaterVolume) on hair, before those of the
//! air.

use super::{
    HairWetting, Moisture, WaterLedger,
    drag::Lock,
    exchange::FoundWater,
    model::clinging,
    moisture::AFTER_DRIP,
    volume::{LocalVolumes, Volumes},
};
use crate::{
    base::{
        parallel::{Nanos, for_each_part, tables},
        schedule::{EffectiveSubsteps, HairStep},
        setting::Settings,
    },
    forces::environment::Gravity,
    hair::strand::{
        AddedMass, Hair, Here, InWater, PerHair, Strand, StrandOf, StrandSleep, TickPose,
        carried_along,
    },
};
use bevy::{math::Isometry3d, prelude::*};

/// Approximate cost of a strand (ns).
const SUBMERGE: Nanos = Nanos(800);

/// A node of which at least this share is under water has no film.
const UNDER: f32 = 0.5;

impl InWater {
    /// Whether the node is submerged.
    pub(super) fn is_under(&self) -> bool {
        self.share >= UNDER
    }
}

/// The water volumes and settings of a hair.
struct LocalWater {
    volumes: LocalVolumes,
    lock: Lock,
    /// The film of a node that emerges (m³).
    film: f64,
    /// The hair's time step (s).
    dt: f32,
    /// Undoes the motion of the frame on its nodes.
    back: Option<Isometry3d>,
}

pub(super) fn submerge(
    (step, steps): (Res<HairStep>, EffectiveSubsteps),
    gravity: Gravity,
    wetting: Settings<HairWetting>,
    volumes: Volumes,
    hairs: Query<&TickPose, With<Hair>>,
    mut strands: Query<(&StrandOf, &StrandSleep, &mut Strand, &mut AddedMass, &mut Moisture), Here>,
    mut ledger: ResMut<WaterLedger>,
    mut found: ResMut<FoundWater>,
) {
    // Goes on for a tick after the last volume was removed, so that all hair emerges from it.
    if !volumes.are_none() {
        found.emerging = step.count;
    } else if found.emerging == 0 {
        return;
    } else {
        found.emerging -= 1;
    }
    let gravity = gravity.clamped().0.length();
    let water_of = |hair: Entity| {
        // While hair skips substeps nothing reads what water does to it.
        let (frame, dt) = (hairs.get(hair).ok()?, steps.of(hair)?.dt);
        let wetting = wetting.of(hair);
        Some(LocalWater {
            volumes: volumes.seen_from(frame),
            lock: wetting.lock(),
            film: AFTER_DRIP * clinging(wetting.bundle(1.0), gravity),
            dt,
            back: frame.back(),
        })
    };
    let gained = for_each_part(
        SUBMERGE,
        tables(&mut strands),
        || (),
        |(), rows| {
            let (mut waters, mut gained) = (PerHair::default(), [0.0, 0.0]);
            for (of, sleep, strand, added, moisture) in rows {
                if let Some(water) = waters.index(of.0, || water_of(of.0)) {
                    let water = &waters.values[water];
                    let dt = sleep.is_simulated().then_some(water.dt);
                    // Inertia has acted on those alone that move in this substep.
                    let back = water.back.as_ref().filter(|_| dt.is_some());
                    let [film, lost] = immerse(water, (dt, back), strand, added, moisture);
                    gained[0] += film;
                    gained[1] += lost;
                }
            }
            gained
        },
    );
    for [film, lost] in gained {
        ledger.water_in += film;
        ledger.water_out += lost;
    }
}

/// Updates a strand for the water around it: velocities and effective masses of its nodes and,
/// where they emerge, their film. Returns the volume of that film and the water of removed nodes
/// (m³).
fn immerse(
    water: &LocalWater,
    (dt, back): (Option<f32>, Option<&Isometry3d>),
    strand: &mut Strand,
    added: &mut AddedMass,
    moisture: &mut Moisture,
) -> [f64; 2] {
    let nodes = strand.nodes();
    let root = strand.positions().first().copied().unwrap_or(Vec3::NAN);
    let near = water.volumes.depth(root).is_some_and(|depth| depth > -strand.length());
    if nodes < 2 || (!near && added.in_water.is_empty()) {
        return [0.0; 2];
    }
    // The number of nodes may have changed.
    added.in_water.resize(nodes, InWater::default());
    let lost = moisture.fit(nodes);
    let mut gained = 0.0;
    let mut any = false;
    for i in 0..nodes {
        let (positions, lengths) = (strand.positions(), strand.rest_lengths());
        let place = |i: usize| carried_along(positions, i, back);
        let segment = |i: Option<usize>| i.and_then(|i| lengths.get(i)).copied().unwrap_or(0.0);
        let own = 0.5 * (segment(i.checked_sub(1)) + segment(Some(i)));
        let depth = water.volumes.water(place(i));
        // Over half the segments on either side.
        let share = depth.map_or(0.0, |(depth, _)| (0.5 + depth / own.max(1e-6)).clamp(0.0, 1.0));
        let before = added.in_water[i];
        added.in_water[i] = InWater { share, ..default() };
        if let Some((_, medium)) = depth.filter(|_| share > 0.0) {
            any = true;
            let (a, b) = (place(i.saturating_sub(1)), place((i + 1).min(nodes - 1)));
            let load = added.mass.get(i).copied().unwrap_or(0.0);
            // Unchanged while the strand is not simulated.
            added.in_water[i] = InWater { share, ..before };
            if let Some(dt) = dt {
                let velocity = &mut strand.velocities_mut()[i];
                let tangent = (b - a).normalize_or(Vec3::Y);
                let (slowed, in_water) =
                    water.lock.immerse(*velocity, tangent, load, (share, &medium), dt);
                (*velocity, added.in_water[i]) = (slowed, in_water);
            }
        }
        if before.is_under() && share < UNDER {
            let film = (water.film - moisture.film()[i]).max(0.0);
            moisture.add_film(i, film);
            gained += film;
        }
    }
    if !any {
        added.in_water.clear();
    }
    [gained, lost]
}
