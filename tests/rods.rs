//! The rods through a real app: sag, length, frame-rate independence, energy.

mod common;
use bevy::prelude::*;
use bevy_keratin::prelude::*;
use common::*;

#[test]
fn probe() {
    for segments in [8, 16, 32] {
        let mut app = test_app(60.0);
        app.insert_resource(HairDefault(AirDrag { rate: 8.0 }));
        app.insert_resource(HairDefault(Cuticle { damage: 0.0, ..default() }));
        app.insert_resource(HairDefault(Stiffness::from_bending_length(0.5).unwrap()));
        let (_, s) = one_strand(&mut app, 0.24, segments, Vec3::X);
        settle(&mut app, s, 60.0);
        let tip = *strand(&app, s).positions().last().unwrap();
        let theory = 0.24f32.powi(4) / (8.0 * 0.5f32.powi(3));
        println!("{segments}: sag {} theory {theory} ratio {}", -tip.y, -tip.y / theory);
    }
    for segments in [8, 16, 32] {
        for hz in [60.0, 120.0, 240.0] {
            let mut app = test_app(hz);
            app.insert_resource(HairDefault(AirDrag { rate: 8.0 }));
            let (_, s) = one_strand(&mut app, 0.24, segments, Vec3::X);
            settle(&mut app, s, 60.0);
            let tip = *strand(&app, s).positions().last().unwrap();
            println!("{segments} {hz}: tip {tip} strain {}", strand(&app, s).peak_strain());
        }
    }
}
