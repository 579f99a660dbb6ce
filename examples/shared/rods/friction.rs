//! Friction: what holds a strand on the things it lies on.

use super::*;

/// Distance that nodes keep from solids (m).
fn clearance() -> f32 {
    StrandContact::default().radius
}

/// A solid and the strand on it, away from all others.
struct Scene {
    strand: Entity,
    solid: Entity,
}

impl Lab {
    /// A strand at rest along `points`, and a solid, both placed by `at` besides.
    fn on(
        &mut self,
        points: &[Vec3],
        soft: f32,
        at: Transform,
        solid: (HairCollider, Vec3),
    ) -> Scene {
        let strand = Strand::from_polyline(points).unwrap_or_default();
        let stiffness = HairStiffness { bending_length: soft, ..default() };
        let world = self.app.world_mut();
        let hair = world.spawn((Hair, stiffness, at)).id();
        let strand = world.spawn((StrandOf(hair), strand)).id();
        let place = at * Transform::from_translation(solid.1);
        Scene { strand, solid: world.spawn((solid.0, place)).id() }
    }

    fn steps(&mut self, ticks: usize, drag: f32) {
        self.app.insert_resource(HairDefault(AirDrag { rate: drag }));
        (0..ticks).for_each(|_| self.app.update());
    }
}

fn solid(solid: Result<HairCollider, bevy_keratin::InvalidValue>, friction: f32) -> HairCollider {
    let solid = solid.and_then(|s| s.with_friction(friction));
    solid.unwrap_or_else(|_| HairCollider::plane(Dir3::Y))
}

/// A soft strand that lies level across a slope of the angle β stays if tan β < μ, else it slides with
/// g (sin β − μ cos β).
pub fn slopes() -> Vec<Row> {
    let mut lab = Lab::new();
    let mut tried = Vec::new();
    for (i, (mu, share)) in
        [0.3, 0.5, 1.0].into_iter().flat_map(|mu| [0.94, 1.06, 1.5].map(|s| (mu, s))).enumerate()
    {
        let beta = f32::atan(mu * share);
        let points: Vec<_> = (0..=32).map(|k| Vec3::X * (LENGTH * k as f32 / 32.0)).collect();
        let size = Vec3::new(0.6, 0.1, 0.6);
        let at = Transform::from_xyz(i as f32, 0.0, 0.0).with_rotation(Quat::from_rotation_x(beta));
        let below = Vec3::NEG_Y * (0.5 * size.y + clearance());
        let block = (solid(HairCollider::cuboid(size), mu), below);
        tried.push((mu, share, beta, lab.on(&points, 0.005, at, block)));
    }
    // Down the slope, of a node that the clamp does not reach yet.
    let way = |lab: &Lab, scene: &Scene| lab.get(scene.strand)[20].z;
    let mut ways = Vec::new();
    for _ in 0..10 {
        lab.steps(1, 0.0);
        ways.push(tried.iter().map(|(.., scene)| way(&lab, scene)).collect::<Vec<_>>());
    }
    lab.steps(60 * 60, 0.0);
    let mut rows = Vec::new();
    for (i, (mu, share, beta, scene)) in tried.iter().enumerate() {
        if *share < 1.0 {
            let moved = way(&lab, scene).abs();
            let test = format!("Friction {mu} on a slope of {share}: moved in a minute (m)");
            rows.push(Row::at_most(test, moved, 1e-4));
        } else {
            let speed = |k: usize| ways[k][i] - ways[k - 1][i];
            let got = (speed(4) - speed(1)) / 3.0 * 3600.0;
            let expected = GRAVITY * (beta.sin() - mu * beta.cos());
            let test = format!("Friction {mu} on a slope of {share}: acceleration (m/s²)");
            // 5 %, and as far off as 6 % of the threshold puts it.
            let tolerance = if *share < 1.1 { expected } else { 0.05 * expected };
            rows.push(Row::new(test, expected, got, tolerance));
        }
    }
    rows
}

/// How many segments of a capstan's strand are slack, and hang before and behind the cylinder.
const SLACK: usize = 12;
const LEG: usize = 14;

/// The tension (in nodes' weights) before which the middle one of three nodes on a cylinder slips, if it has this one
/// behind it. Without its own weight T₂/T₁ is (1 + μ tan(Δ/2))/(1 − μ tan(Δ/2)), Δ the angle by which the strand turns.
fn held_after(tension: f32, mu: f32, places: &[Vec3]) -> f32 {
    let [before, after] = [1, 2].map(|k| (places[k] - places[k - 1]).normalize());
    let (sine, cosine) = (0.5 * before.angle_between(after)).sin_cos();
    let along = (before + after).normalize();
    let out = Vec3::new(-along.y, along.x, 0.0);
    let weight = Vec3::NEG_Y.dot(along + mu * out);
    (tension * (cosine + mu * sine) - weight) / (cosine - mu * sine)
}

/// A strand over a cylinder, a weight at each end, of which one grows until the strand slips.
pub fn capstans() -> Vec<Row> {
    use std::f32::consts::PI;
    const SECONDS: f32 = 40.0;
    let radius = 0.03;
    let mut lab = Lab::new();
    let mut tried = Vec::new();
    for (i, (mu, nodes)) in
        [0.1, 0.3, 0.5].into_iter().flat_map(|mu| [16, 32].map(|n| (mu, n))).enumerate()
    {
        let out = radius + clearance();
        // Nodes lie on the surface, the chords between them in it.
        let angle = PI / nodes as f32;
        let edge = 2.0 * out * (0.5 * angle).sin();
        let mut points = Vec::new();
        // Slack: half a circle of its own, from the clamp to the first weight.
        let low = -(LEG as f32) * edge;
        let loop_radius = SLACK as f32 * edge / PI;
        for k in 0..SLACK {
            let (sine, cosine) = (PI * k as f32 / SLACK as f32).sin_cos();
            let across = -out - loop_radius * (1.0 + cosine);
            points.push(Vec3::new(across, low - loop_radius * sine, 0.0));
        }
        points.extend((0..LEG).map(|k| Vec3::new(-out, low + edge * k as f32, 0.0)));
        for k in 0..=nodes {
            let (sine, cosine) = (PI - angle * k as f32).sin_cos();
            points.push(Vec3::new(out * cosine, out * sine, 0.0));
        }
        points.extend((1..=LEG).map(|k| Vec3::new(out, -edge * k as f32, 0.0)));
        let at = Transform::from_xyz(i as f32, 0.0, 0.0);
        let cylinder = (solid(HairCollider::cylinder(radius, 0.2), mu), Vec3::ZERO);
        let scene = lab.on(&points, 0.003, at, cylinder);
        if let Some(mut place) = lab.app.world_mut().get_mut::<Transform>(scene.solid) {
            place.rotate_x(0.5 * PI);
        }
        tried.push((mu, nodes, points.len(), scene, None, Vec::new()));
    }
    // Weights in nodes' own: cells are alike.
    let (first, ticks) = (30.0, (60.0 * SECONDS) as usize);
    for tick in 0..ticks {
        for (mu, _, count, scene, released, falls) in &mut tried {
            if released.is_some() {
                continue;
            }
            let places = lab.get(scene.strand);
            let lies = |p: &Vec3| p.y > -0.01 && p.xy().length() < radius + clearance() + 1e-4;
            let share = 0.5 + 0.75 * tick as f32 / ticks as f32;
            // The slack's lower half hangs on the first weight, which is held up by T₁.
            let touches = |k: &usize| lies(&places[*k]);
            let [top, last] = [(SLACK..*count).find(touches), (SLACK..*count).rfind(touches)];
            let (top, last) = (top.unwrap_or(SLACK), last.unwrap_or(SLACK));
            let lowest =
                (0..SLACK).min_by(|a, b| places[*a].y.total_cmp(&places[*b].y)).unwrap_or(0);
            let before = first + (top - lowest) as f32;
            let on = |tension, k: usize| held_after(tension, *mu, &places[k - 1..=k + 1]);
            let most = (top..=last.min(*count - 2)).fold(before, on);
            let behind = (*count - 1 - last) as f32 - 0.5;
            let wanted = before * (share * (most / before).ln()).exp() - behind;
            let tip = places[*count - 1].y;
            falls.push((share, tip));
            if let [.., (from, before), _, _, _, _, _, _, _, _, _] = falls[..]
                && tick > 60
                && before - tip > 1e-3 * 9.0 / 60.0
            {
                *released = Some(from);
                continue;
            }
            let mut added = vec![0.0; *count];
            added[SLACK] = first;
            // The tip has half a cell.
            added[*count - 1] = 2.0 * wanted.max(0.0);
            if let Some(mut mass) = lab.app.world_mut().get_mut::<AddedMass>(scene.strand) {
                mass.mass = added;
            }
        }
        lab.steps(1, 4.0);
    }
    (tried.into_iter())
        .map(|(mu, nodes, _, _, released, _)| {
            let test = format!("Capstan, friction {mu}, {nodes} segments on it: share of ln T₂/T₁");
            // Where friction is slight, so are the forces that tell the nodes' states.
            let tolerance = if mu < 0.2 { 0.05 } else { 0.03 };
            Row::new(test, 1.0, released.unwrap_or(f32::INFINITY), tolerance)
        })
        .collect()
}

/// K: how far (in lengths) a plate raises the tip of a weightless strand that points down, and the friction with which
/// it slips there.
pub const SLIPS: [[f32; 2]; 7] = [
    [0.01, 0.0449],
    [0.05, 0.1035],
    [0.1, 0.1528],
    [0.2, 0.2378],
    [0.3, 0.3265],
    [0.4, 0.4344],
    [0.5, 0.5845],
];

/// K: a strand stands on a plate that comes nearer: it buckles, then its tip slips.
pub fn slips(segments: &[usize]) -> Vec<Row> {
    const SECONDS: f32 = 40.0;
    let mut lab = Lab::new();
    lab.gravity(0.0);
    let mut tried = Vec::new();
    let cases = SLIPS[..5].iter().flat_map(|s| segments.iter().map(move |n| (s, *n)));
    for (i, (&[rise, mu], segments)) in cases.enumerate() {
        let at = |k: usize| {
            let share = k as f32 / segments as f32;
            Vec3::new(1e-3 * share * share, -share, 0.0) * LENGTH
        };
        let points: Vec<_> = (0..=segments).map(at).collect();
        let size = Vec3::new(0.5, 0.1, 0.5);
        let start = Vec3::NEG_Y * (0.5 * size.y + clearance() + LENGTH);
        let plate = (solid(HairCollider::cuboid(size), mu), start);
        let at = Transform::from_xyz(i as f32, 0.0, 0.0);
        tried.push((rise, mu, segments, lab.on(&points, 0.5 * LENGTH, at, plate), None::<f32>));
    }
    let ticks = (60.0 * SECONDS) as usize;
    for tick in 0..ticks {
        // It buckles by the square root of the way.
        let share = 1.4 * (tick as f32 / ticks as f32).powi(2);
        for (rise, _, _, scene, slipped) in &mut tried {
            let tip = lab.get(scene.strand).last().map_or(0.0, |tip| tip.xz().length() / LENGTH);
            if slipped.is_none() && (tip - 1e-3).abs() > 4e-4 {
                *slipped = Some(share * *rise);
            }
            let up = share * *rise * LENGTH - (0.05 + clearance() + LENGTH);
            if let Some(mut place) = lab.app.world_mut().get_mut::<Transform>(scene.solid) {
                place.translation.y = up;
            }
        }
        lab.steps(1, 8.0);
    }
    (tried.into_iter())
        .map(|(rise, mu, segments, _, slipped)| {
            // Friction for which it would be right, by theory's curve.
            let at = slipped.unwrap_or(f32::INFINITY);
            let got = mu * friction_at(at) / friction_at(rise);
            let test = "K friction with which a tip slips".to_string();
            Row::new(test, mu, got, 0.05 * mu * allowed(1.0, segments)).of(rise, segments)
        })
        .collect()
}

/// Theory's friction for a rise, between the points of its table as a power.
fn friction_at(rise: f32) -> f32 {
    let above = SLIPS.iter().position(|s| s[0] >= rise).unwrap_or(SLIPS.len() - 1).max(1);
    let ([a, f], [b, g]) = (SLIPS[above - 1], SLIPS[above]);
    f * (rise / a).powf((g / f).ln() / (b / a).ln())
}
