//! Twist of rods that are clamped at both ends.

use super::{
    onset::{IMPERFECTION, onset_in},
    *,
};

/// Turns the held end of a ring about the x axis, up to an angle (rad).
#[derive(Component)]
struct Crank {
    most: f32,
    /// Share of the angle that is reached.
    share: f32,
    /// At no angle.
    frame: Quat,
}

fn crank(step: Res<bevy_keratin::HairStep>, mut cranks: Query<(&mut Crank, &mut HeldNodes)>) {
    /// How long the ends are turned (s).
    const SECONDS: f32 = 20.0;
    for (mut crank, mut held) in &mut cranks {
        crank.share = (crank.share + step.dt / SECONDS).min(1.0);
        let turn = Quat::from_rotation_x(crank.most * crank.share);
        if let Some(last) = held.frames.last_mut() {
            *last = Some(turn * crank.frame);
        }
    }
}

/// Lets the held end of a straight rod come closer as the rod leaves the x axis, by what its edges reach.
#[derive(Component)]
struct FreeToApproach;

fn approach(mut rods: Query<(&Strand, &mut HeldNodes), With<FreeToApproach>>) {
    for (strand, mut held) in &mut rods {
        let (places, last) = (strand.positions(), strand.edges() - 1);
        let lengths = strand.rest_lengths();
        let pairs = places.windows(2).zip(lengths).take(last);
        let along: f32 = pairs.map(|(p, l)| l * (p[1] - p[0]).normalize_or_zero().x).sum();
        held.targets[last] = Some(Vec3::X * along);
        held.targets[last + 1] = Some(Vec3::X * (along + lengths[last]));
    }
}

/// H: a straight rod whose ends are clamped, one free to approach, buckles when it is twisted by 8.9868 E I/(G J).
pub fn wrung() -> Vec<Row> {
    let mut lab = Lab::new();
    // A rod that sags a little chooses a side.
    lab.gravity(0.03 * GRAVITY);
    lab.app.add_systems(HairTick, (crank, approach).chain().in_set(HairSystems::First));
    let mut tried = Vec::new();
    for (torsion, segments) in [1.0, 0.46].into_iter().flat_map(|c| SEGMENTS.map(|n| (c, n))) {
        let onset = 8.9868 / torsion;
        let rods = wide_shares().map(|share| clamped(&mut lab, torsion, segments, share * onset));
        tried.push((torsion, segments, onset, rods.collect::<Vec<_>>()));
    }
    lab.settle(2.0, 60.0);
    let away = |p: &Vec3| p.yz().length() / LENGTH;
    let shares: Vec<f32> = wide_shares().collect();
    (tried.into_iter())
        .map(|(torsion, segments, at, rods)| {
            let left = rods.iter().zip(&shares).map(|(rod, share)| {
                let bow = lab.get(*rod).iter().map(away).fold(0.0, f32::max);
                bow.max(lost_twist(&lab, *rod, share * at))
            });
            let got = onset_in(&shares, &left.collect::<Vec<_>>(), true);
            let test = format!("H twist of a clamped rod, C {torsion}");
            Row::new(test, 1.0, got, allowed(0.03, segments)).of(at, segments)
        })
        .collect()
}

/// A straight strand along x whose rod, between the middles of its outer edges, has this many segments.
fn straight(segments: usize) -> Strand {
    let edge = LENGTH / segments as f32;
    let points: Vec<Vec3> = (0..=segments + 1).map(|i| Vec3::X * (edge * i as f32)).collect();
    Strand::from_polyline(&points).unwrap_or_default()
}

/// A straight rod.
fn clamped(lab: &mut Lab, torsion: f32, segments: usize, twist: f32) -> Entity {
    let strand = straight(segments);
    let ends = [segments, segments + 1].map(|i| strand.positions()[i]);
    let crank = Crank { most: twist, share: 0.0, frame: strand.root_frame() };
    lab.cranked(torsion, strand, ends, (crank, FreeToApproach))
}

impl Lab {
    /// A rod whose outer edges are held: the first along x, the last at `ends`, where it can be turned.
    fn cranked(
        &mut self,
        torsion: f32,
        strand: Strand,
        ends: [Vec3; 2],
        more: impl Bundle,
    ) -> Entity {
        let nodes = strand.nodes();
        let mut held = HeldNodes::default();
        held.targets.resize(nodes - 2, None);
        held.targets.extend(ends.map(Some));
        held.targets[1] = strand.rest_lengths().first().map(|edge| Vec3::X * *edge);
        held.frames.resize(nodes - 1, None);
        held.frames[1] = Some(strand.root_frame());
        held.frames.push(Some(strand.root_frame()));
        let stiffness = HairStiffness { bending_length: LENGTH, torsion, ..default() };
        let world = self.app.world_mut();
        let hair = world.spawn((Hair, stiffness)).id();
        world.spawn((StrandOf(hair), strand, held, more)).id()
    }
}

/// G: a straight-born rod bent to a circle leaves its plane when it is twisted by 2π √3 E I/(G J).
pub fn rings() -> Vec<Row> {
    use std::f32::consts::TAU;
    let mut lab = Lab::new();
    lab.gravity(0.0);
    lab.app.add_systems(HairTick, crank.in_set(HairSystems::First));
    let mut tried = Vec::new();
    for (torsion, segments) in
        [(1.0, 8), (1.0, 16), (1.0, 32), (1.0, 64), (0.46, 16), (0.46, 32), (0.46, 64)]
    {
        let onset = TAU * 3.0_f32.sqrt() / torsion;
        let rods = wide_shares().map(|share| ring(&mut lab, torsion, segments, share * onset));
        tried.push((torsion, segments, onset, rods.collect::<Vec<_>>()));
    }
    lab.settle(2.0, 80.0);
    let mut rows = Vec::new();
    for (torsion, segments, at, rods) in tried {
        let rods = rods.iter().zip(wide_shares());
        let lost = rods.map(|(rod, share)| lost_twist(&lab, *rod, share * at));
        let lost: Vec<f32> = lost.collect();
        // Twists of 1.5 rad a joint are 1.1 times as large in the measure 2 sin(τ/2).
        let even = if torsion < 1.0 { 32.0 } else { 16.0 };
        let tolerance = 0.03 * (even / segments as f32).powi(2).max(1.0);
        let shares: Vec<f32> = wide_shares().collect();
        let got = onset_in(&shares, &lost, true);
        let test = format!("G twist of a ring, C {torsion}");
        rows.push(Row::new(test, 1.0, got, tolerance).of(at, segments));
    }
    rows
}

/// How much of its twist (rad) a rod has lost, in two turns: as many as one that buckles loses when it goes on through
/// itself.
fn lost_twist(lab: &Lab, rod: Entity, given: f32) -> f32 {
    let strand = lab.app.world().get::<Strand>(rod);
    let twist = |d: Quat| 2.0 * f32::atan2(d.z, d.w);
    let left: f32 = strand.map_or(f32::NAN, |s| (0..s.edges()).map(|j| twist(s.darboux(j))).sum());
    (given - left).abs() / (2.0 * std::f32::consts::TAU)
}

fn wide_shares() -> impl Iterator<Item = f32> {
    (0..=30).map(|i| 0.85 + 0.01 * i as f32)
}

/// A closed ring in the xy plane, both ends clamped in one frame.
fn ring(lab: &mut Lab, torsion: f32, segments: usize, twist: f32) -> Entity {
    let mut strand = straight(segments);
    let ends = [0, 1].map(|i| strand.positions()[i]);
    let bonds = Bonds::of(&strand);
    let frame = strand.root_frame();
    let angle = std::f32::consts::TAU / segments as f32;
    let bend = Quat::from_axis_angle(frame.inverse() * Vec3::Z, angle).xyz();
    strand.pose((0..=segments).map(|i| if i == 0 { Vec3::ZERO } else { bend }));
    for (i, place) in strand.positions_mut().iter_mut().enumerate() {
        place.z += IMPERFECTION * LENGTH * (angle * (i as f32 - 0.5)).sin().powi(2);
    }
    let crank = Crank { most: twist, share: 0.0, frame };
    lab.cranked(torsion, strand, ends, (crank, bonds))
}
