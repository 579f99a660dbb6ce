//! Heads that are suddenly elsewhere: blinks and snap turns.

use crate::common::{faults, run, strand, test_app};
use bevy::prelude::*;
use bevy_keratin::prelude::*;

const HEAD: f32 = 0.09;

/// A head with strands of 40 cm all over its upper half, settled.
fn settled() -> (App, Entity, Vec<Entity>) {
    let mut app = test_app(60.0);
    let ball = HairCollider::sphere(HEAD).unwrap();
    let head = app.world_mut().spawn((ball, Transform::from_xyz(0.0, 1.6, 0.0))).id();
    let hair = app.world_mut().spawn((Hair, ChildOf(head))).id();
    let strands = (0..40).map(|i| {
        let y = (i as f32 + 0.5) / 40.0;
        let across = (1.0 - y * y).sqrt();
        let (sine, cosine) = (2.4 * i as f32).sin_cos();
        let normal = Vec3::new(across * cosine, y, across * sine);
        let points: Vec<Vec3> =
            (0..17).map(|k| normal * (HEAD + 0.002 + 0.025 * k as f32)).collect();
        let strand = Strand::from_polyline(&points).unwrap();
        app.world_mut().spawn((StrandOf(hair), strand)).id()
    });
    let strands = strands.collect();
    run(&mut app, 8.0);
    (app, head, strands)
}

/// In the head's frame.
fn nodes(app: &App, strands: &[Entity]) -> Vec<Vec3> {
    strands.iter().flat_map(|id| strand(app, *id).positions().to_vec()).collect()
}

#[test]
fn hair_of_a_head_that_is_suddenly_elsewhere_lies_as_it_lay() {
    // Below 25 m/s and 40 rad/s these are motion, else jumps.
    for (way, turn) in
        [(0.25, 0.0f32), (0.41, 0.0), (1.0, 0.0), (0.0, 37.0), (0.0, 90.0), (0.2, 90.0)]
    {
        let (mut app, head, strands) = settled();
        let before = nodes(&app, &strands);
        let mut place = app.world_mut().get_mut::<Transform>(head).unwrap();
        place.translation.x += way;
        place.rotate_y(turn.to_radians());
        let mut strain = 0.0f32;
        for _ in 0..180 {
            app.update();
            for id in &strands {
                let strand = strand(&app, *id);
                for (ends, l) in strand.positions().windows(2).zip(strand.rest_lengths()) {
                    strain = strain.max((ends[0].distance(ends[1]) / l - 1.0).abs());
                }
            }
        }
        let after = nodes(&app, &strands);
        let squares = before.iter().zip(&after).map(|(a, b)| a.distance_squared(*b));
        let rms = (squares.sum::<f32>() / after.len() as f32).sqrt();
        println!("{way} m {turn}°: strain {strain}, {} mm off", rms * 1e3);
        let is_jump = way >= 1.0 || turn >= 90.0;
        assert!(strain < if is_jump { 1e-3 } else { 0.02 }, "{way} m {turn}°: strain {strain}");
        assert!(rms < if is_jump { 1e-4 } else { 0.02 }, "{way} m {turn}°: {rms} m off");
        assert_eq!(faults(&mut app).len(), 0);
    }
}
