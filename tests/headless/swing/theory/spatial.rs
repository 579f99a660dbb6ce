//! A heavy rod in space: Kirchhoff's equations, shot from root to tip.
//!
//! r′ = d₃, frame′ = frame × κ, κ = κ₀ + (m·d₁/E I, m·d₂/E I, m·d₃/G J), m′ = −d₃ × n, and the force
//! n = −μ g (L − s) ŷ is known beforehand. The root's frame is given; its moment is what makes the
//! tip's vanish.

use super::{GRAVITY, bending_stiffness};
use bevy::math::{DMat3, DQuat, DVec3};
use core::f64::consts::TAU;

/// A rod that is a helix about a vertical axis when nothing pulls at it.
#[derive(Clone, Copy)]
pub struct Helix {
    /// Radius (m).
    pub radius: f64,
    /// Height of a turn (m).
    pub pitch: f64,
    /// Length along it (m).
    pub length: f64,
}

impl Helix {
    /// Where it is at `s` along it, from its axis, winding downward.
    pub fn point(&self, s: f64) -> DVec3 {
        let (rise, angle) = (self.rise(), s / self.radius.hypot(self.rise()));
        DVec3::new(self.radius * angle.cos(), -rise * angle, self.radius * angle.sin())
    }

    fn rise(&self) -> f64 {
        self.pitch / TAU
    }

    /// Root frame with the tangent as third axis and the normal as first.
    fn frame(&self) -> DQuat {
        let tangent = DVec3::new(0.0, -self.rise(), self.radius).normalize();
        let normal = DVec3::NEG_X;
        DQuat::from_mat3(&DMat3::from_cols(normal, tangent.cross(normal), tangent))
    }

    /// Curvature and torsion of the helix in that frame, carried along (1/m).
    fn curvature(&self) -> DVec3 {
        // The frame turns about the helix's axis, from x to z.
        self.frame().inverse() * DVec3::NEG_Y / self.radius.hypot(self.rise())
    }

    /// How far its tip hangs below its root (m), clamped at the root along its tangent, with
    /// `torsional` = G J / E I.
    pub fn hanging_height(&self, bending_length: f64, torsional: f64) -> f64 {
        let stiffness = bending_stiffness(bending_length);
        let rod = Rod {
            length: self.length,
            curvature: self.curvature(),
            compliance: DVec3::new(1.0, 1.0, 1.0 / torsional) / stiffness,
            frame: self.frame(),
        };
        -rod.hang().y
    }
}

struct Rod {
    length: f64,
    curvature: DVec3,
    compliance: DVec3,
    frame: DQuat,
}

#[derive(Clone, Copy)]
struct State {
    place: DVec3,
    frame: DQuat,
    moment: DVec3,
}

impl Rod {
    /// The tip's place under gravity, seen from the root.
    fn hang(&self) -> DVec3 {
        let mut moment = DVec3::ZERO;
        const STEPS: usize = 20;
        for step in 1..=STEPS {
            let gravity = GRAVITY * step as f64 / STEPS as f64;
            for iteration in 0.. {
                let miss = self.shoot(moment, gravity).moment;
                // Moments are to vanish beside those of the weight, μ g L²/2.
                let scale = 0.5 * gravity * self.length * self.length;
                if miss.length() < 1e-10 * scale {
                    break;
                }
                assert!(iteration < 60, "shooting did not converge at {gravity}: {miss}");
                let h = 1e-6 * scale;
                let column = |axis| (self.shoot(moment + h * axis, gravity).moment - miss) / h;
                let jacobian =
                    DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z));
                moment -= jacobian.inverse() * miss;
            }
        }
        self.shoot(moment, GRAVITY).place
    }

    /// Runge–Kutta of fourth order from root to tip.
    fn shoot(&self, moment: DVec3, gravity: f64) -> State {
        const STEPS: usize = 600;
        let h = self.length / STEPS as f64;
        let mut state = State { place: DVec3::ZERO, frame: self.frame, moment };
        for step in 0..STEPS {
            let s = h * step as f64;
            let a = self.slope(&state, s, gravity);
            let b = self.slope(&state.along(&a, 0.5 * h), s + 0.5 * h, gravity);
            let c = self.slope(&state.along(&b, 0.5 * h), s + 0.5 * h, gravity);
            let d = self.slope(&state.along(&c, h), s + h, gravity);
            for (slope, weight) in [(a, 1.0), (b, 2.0), (c, 2.0), (d, 1.0)] {
                state = state.along(&slope, h * weight / 6.0);
            }
            state.frame = state.frame.normalize();
        }
        state
    }

    fn slope(&self, state: &State, s: f64, gravity: f64) -> State {
        // A step's intermediate frames are not quite of unit length.
        let turn = state.frame.normalize();
        let tangent = turn * DVec3::Z;
        let force = DVec3::NEG_Y * gravity * (self.length - s);
        let k = self.curvature + self.compliance * (turn.inverse() * state.moment);
        State {
            place: tangent,
            frame: state.frame * DQuat::from_xyzw(k.x, k.y, k.z, 0.0) * 0.5,
            moment: force.cross(tangent),
        }
    }
}

impl State {
    fn along(&self, slope: &Self, h: f64) -> Self {
        Self {
            place: self.place + slope.place * h,
            frame: self.frame + slope.frame * h,
            moment: self.moment + slope.moment * h,
        }
    }
}

mod tests {
    use super::{
        super::{near, planar},
        *,
    };

    const CURL: Helix = Helix { radius: 0.01, pitch: 0.02, length: 0.24 };

    #[test]
    fn without_weight_it_keeps_its_height() {
        let turn = (TAU * 0.01).hypot(0.02);
        near(-CURL.point(0.24).y, 0.02 * 0.24 / turn, 1e-12);
        // Endlessly stiff: nothing gives.
        near(CURL.hanging_height(10.0, 1.0), 0.0728, 1e-3);
    }

    #[test]
    fn height_agrees_with_another_solver() {
        // A rod of 96 edges in another language, left to settle.
        near(CURL.hanging_height(0.06, 1.0), 0.0855, 3e-3);
        // Less resistance to twist, more height.
        assert!(CURL.hanging_height(0.06, 2.0 / 3.0) > CURL.hanging_height(0.06, 1.0));
    }

    #[test]
    fn a_straight_rod_sags_as_the_elastica() {
        for (length, bending_length) in [(0.1, 0.13), (0.2, 0.13), (0.2, 0.06)] {
            let rod = Rod {
                length,
                curvature: DVec3::ZERO,
                compliance: DVec3::splat(1.0 / bending_stiffness(bending_length)),
                frame: DQuat::from_rotation_arc(DVec3::Z, DVec3::X),
            };
            near(-rod.hang().y / length, planar::level(length, bending_length).sag(), 1e-3);
        }
    }
}
