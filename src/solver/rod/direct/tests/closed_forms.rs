//! Turns, held nodes, masses and stiffnesses against closed forms.

use super::*;

#[test]
fn frames_turn_with_their_edges_by_the_shortest_way() {
    let w = Single::<f64>::default();
    let lane = |v: DVec3| V3::new(v.x, v.y, v.z);
    let plain = |v: V3<f64>| DVec3::new(v.x, v.y, v.z);
    for k in 0..200 {
        let wave = |rate: f64| (rate * f64::from(k) + rate).sin();
        let q = DQuat::from_scaled_axis(3.0 * DVec3::new(wave(1.3), wave(2.7), wave(0.9)));
        let before = Quaternion::new(V3::new(q.x, q.y, q.z), q.w);
        // Now and then the edge turns over.
        let way =
            if k % 5 == 0 { q * -DVec3::Z } else { DVec3::new(wave(0.7), wave(1.1), wave(1.9)) };
        let (way, length) = (way.normalize(), 0.01 * (1.0 + 0.5 * wave(3.1)));
        let e = way * length;
        let (after, turn) = super::frames::parallel_transport(before, lane(e), length);
        let after = DQuat::from_xyzw(after.v.x, after.v.y, after.v.z, after.w);
        assert!((after.length() - 1.0).abs() < 1e-9 && (after * DVec3::Z).distance(way) < 1e-6);
        let apart = q.normalize().angle_between(after.normalize());
        let shortest = (q * DVec3::Z).angle_between(way);
        assert!((apart - shortest).abs() < 1e-5, "{apart} rad for {shortest}");
        // Twice the vector part of that rotation: twice the sine of half the angle.
        assert!((plain(turn).length() - 2.0 * (0.5 * shortest).sin()).abs() < 1e-6);
        // The same, of an edge that pointed along the frame as the substep began.
        let node = |from: DVec3| NodeLanes { from: from.to_array(), ..Default::default() };
        let (start, end) = (node(way), node(way + q * DVec3::Z * length));
        let since = plain(super::frames::turned_since(w, &start, &end, lane(way)));
        if k % 5 == 0 {
            assert_eq!(since, DVec3::ZERO, "no way is the shortest");
        } else {
            assert!(since.distance(plain(turn)) < 1e-6, "{since} {turn:?}");
        }
    }
}

/// Roots lie under the skin, inside of colliders.
#[test]
fn held_nodes_within_an_obstacle_end_at_their_targets() {
    let floor = Solid::HalfSpace { normal: Vec3::Y, point: Vec3::Y * 0.002 };
    let floor = [Obstacle { solid: floor, motion: None, friction: 0.4 }];
    for way in [Vec3::ZERO, Vec3::new(2e-4, -1e-4, 1e-4)] {
        let upright = |lane: usize, i: usize| {
            let i = i as f32;
            Vec3::new(0.012 * i, 0.004 * i, 1e-3 * (i + lane as f32).sin())
        };
        let mut block = strands(12, upright);
        for _ in 0..10 {
            let from = block.nodes[0].p;
            let target = block.nodes[0].p.map(|c| c[3]);
            let target = Vec3::from(target) + way;
            for lane in 0..LANES {
                let to = take3(&from, lane) + way;
                put3(&mut block.nodes[0].p, lane, to);
            }
            prepare(&mut block, 0.13);
            block.nodes[0].from = from;
            step(Level::new(), &mut block, &params(), &floor);
            assert_eq!(take3(&block.nodes[0].p, 3), target, "moved by {way}");
        }
    }
}

/// Masses and stiffnesses in f64, by the documented formulas.
#[test]
fn masses_and_stiffnesses_are_those_of_the_hair() {
    // Ordinary hair; hair much too stiff for its length; segments so fine that f32 is not enough.
    let hairs = [(9, 0.01, 0.1, DT), (9, 0.01, 3.0, DT), (250, 5e-4, 0.1, 2.0 * DT)];
    for (edges, length, bending_length, dt) in hairs {
        let rest = |lane: usize, i: usize| length * (1.0 + 0.3 * ((lane + 2 * i) as f32).sin());
        let load = |lane: usize, i: usize| 1.0 + 0.2 * ((3 * lane + i) % 5) as f32;
        let share = |lane: usize, i: usize| 1.0 - 0.1 * ((lane + i) % 4) as f32;
        let mut block = BlockLanes::default();
        block.resize(edges + 1);
        for lane in 0..LANES {
            for (i, edge) in block.edges.iter_mut().enumerate() {
                (edge.l[lane], edge.k[lane]) = (rest(lane, i), share(lane, i));
            }
            for (i, node) in block.nodes.iter_mut().enumerate() {
                node.w[lane] = if i == 0 { 0.0 } else { load(lane, i) };
            }
        }
        weigh(Level::new(), &mut block, bending_length, dt);
        let near = |what: &str, found: f32, expected: f64| {
            let off = (f64::from(found) / expected - 1.0).abs();
            assert!(off < 1e-4, "{what} {found}, expected {expected}; {length} {bending_length}");
        };
        for lane in [0, 6, 15] {
            let l: Vec<f64> = (0..edges).map(|i| f64::from(rest(lane, i))).collect();
            let (n, sum, dt) = (edges as f64, l.iter().sum::<f64>(), f64::from(dt));
            let g = f64::from(REFERENCE_GRAVITY);
            // A whole node weighs 1: EI = 2 g ρ L_g³, limited to L_g of six lengths.
            let density = n / sum;
            let ei = density * 2.0 * g * f64::from(bending_length).min(6.0 * sum).powi(3);
            let most = 2.5e10 / (n * dt).powi(2);
            for i in 0..edges {
                let before = if i == 0 { 0.0 } else { l[i - 1] };
                let joint = f64::from(share(lane, i)) * ei / (before + l[i]);
                let edge = &block.edges[i];
                near("bending", edge.k[lane], joint.min(most * l[i] * l[i]));
                // E A l²/(E I) is 10 at least.
                let least = (10.0 * 0.5 * ei / l[i].powi(3)).min(most / 16.0);
                near("stretching", edge.axial[lane], (g * n / 1e-4 / l[i]).min(most).max(least));
            }
            for i in 0..=edges {
                let before = if i == 0 { 0.0 } else { l[i - 1] };
                let after = l.get(i).copied().unwrap_or(0.0);
                let node = &block.nodes[i];
                if i == 0 {
                    assert_eq!((node.mass[lane], node.w[lane]), (0.0, 0.0), "held");
                    continue;
                }
                let mass = 0.5 * (before + after) * density * f64::from(load(lane, i));
                near("mass", node.mass[lane], mass);
                near("1/mass", node.w[lane], 1.0 / mass);
            }
            let mean = 1.0 / density;
            let rigidity = (0.5 * ei).min(most * mean.powi(3));
            let resisted = (3.0 * density / dt.powi(2) / rigidity).powf(0.25);
            near("twist", block.max_twist[lane], resisted.max(8.99 / sum));
        }
    }
}
