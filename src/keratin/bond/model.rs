//! Side-chain bonds as pure functions: equations 13–16 and 19 of \[B\], on one joint at a time.

use super::kind::BondKind;
use crate::base::{
    lanes::{Quaternion, Real, V3},
    setting::{Ranged, ValueRange, Violations},
};
use bevy::reflect::Reflect;
use glam::{Quat, Vec3};

/// The bonds of one joint: for each kind its remembered shape Ω_j and its rate b_j ∈ \[0, 1\]. One
/// cache line.
#[repr(C)]
#[derive(Reflect, Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct JointBonds {
    /// Remembered Darboux vector Ω_j of each kind, by [`BondKind`] as index.
    pub shapes: [Vec3; BondKind::COUNT],
    /// Rate b_j of each kind: 1 all bonds closed, 0 all broken.
    pub rates: [f32; BondKind::COUNT],
}

impl Default for JointBonds {
    fn default() -> Self {
        Self::closed(Vec3::ZERO)
    }
}

impl JointBonds {
    /// All bonds closed around the shape `omega`.
    pub fn closed(omega: Vec3) -> Self {
        Self { shapes: [omega; BondKind::COUNT], rates: [1.0; BondKind::COUNT] }
    }

    /// [`rest_shape`] of this joint: equation 15.
    #[inline]
    pub fn rest_shape(&self, omega: Quat, influence: &[f32; BondKind::COUNT]) -> Quat {
        let bonds = core::array::from_fn(|j| self.kind(j));
        let Quaternion { v, w } = rest_shape(quaternion(omega), &bonds, influence);
        Quat::from_xyzw(v.x, v.y, v.z, w)
    }

    /// [`changed`] bonds of kind `j` of this joint: equation 16.
    #[inline]
    pub fn change(&mut self, j: usize, change: f32, omega: Quat) {
        let Remembered { shape: V3 { x, y, z }, rate } =
            changed(self.kind(j), change, quaternion(omega));
        (self.shapes[j], self.rates[j]) = (Vec3::new(x, y, z), rate);
    }

    fn kind(&self, j: usize) -> Remembered<f32> {
        let [x, y, z] = self.shapes[j].to_array();
        Remembered { shape: V3::new(x, y, z), rate: self.rates[j] }
    }

    /// The shape the bonds alone would rest in: Ω* = Σ f b Ω_j / Σ f b (zero when all are broken).
    pub fn relaxed(&self, influence: &[f32; BondKind::COUNT]) -> Vec3 {
        let (sum, closed) = (0..BondKind::COUNT).fold((Vec3::ZERO, 0.0), |(s, t), j| {
            let fb = influence[j] * self.rates[j];
            (s + self.shapes[j] * fb, t + fb)
        });
        if closed > 0.0 { sum / closed } else { Vec3::ZERO }
    }

    /// B = Σ f b / Σ f: the share of the joint's stiffness that is left.
    pub fn closed_share(&self, influence: &[f32; BondKind::COUNT]) -> f32 {
        let (sum, total) = (0..BondKind::COUNT)
            .fold((0.0, 0.0), |(s, t), j| (s + influence[j] * self.rates[j], t + influence[j]));
        sum / total
    }

    /// Whether every number is finite and every rate in \[0, 1\].
    #[doc(hidden)]
    pub fn is_valid(&self) -> bool {
        self.shapes.iter().all(|s| s.is_finite())
            && self.rates.iter().all(|b| (0.0..=1.0).contains(b))
    }
}

impl JointBonds {
    /// The range of [`rates`](Self::rates).
    pub const RATES: ValueRange =
        ValueRange::new("JointBonds::rates", 0.0..=1.0, "0 all broken, 1 all closed");
    const SHAPES: ValueRange = ValueRange::new(
        "JointBonds::shapes",
        -1.01..=1.01,
        "give the imaginary part of a unit quaternion",
    );
}

impl Ranged for JointBonds {
    fn clamp_values(&mut self, violations: &mut Violations) {
        for (shape, rate) in self.shapes.iter_mut().zip(&mut self.rates) {
            Self::RATES.clamp(rate, || 1.0, violations);
            Self::SHAPES.clamp(shape, || Vec3::ZERO, violations);
        }
    }
}

fn quaternion(q: Quat) -> Quaternion<f32> {
    Quaternion::new(V3::new(q.x, q.y, q.z), q.w)
}

/// One kind of bonds of a joint, or of many joints side by side.
#[derive(Clone, Copy, Debug)]
pub struct Remembered<R> {
    /// Ω_j.
    pub shape: V3<R>,
    /// b_j.
    pub rate: R,
}

impl<R: Real> Remembered<R> {
    /// Whether the present shape is in the other hemisphere than the remembered one, so that −Ω is
    /// nearer to it. Real parts are ≥ 0.
    #[inline(always)]
    fn is_opposite(&self, omega: Quaternion<R>) -> R::Mask {
        // Ω·Ω_j + w √(1 − |Ω_j|²) < 0, without the root.
        let zero = omega.w.lit(0.0);
        let away = (-omega.v.dot(self.shape)).max(zero);
        let square = (zero.lit(1.0) - self.shape.dot(self.shape)).max(zero);
        (omega.w * omega.w * square).lt(away * away)
    }
}

/// Equation 15: Ω0 = Σ f_j {Ω_j + (1−b_j)(Ω − Ω_j)} / Σ f_j, as a full quaternion.
///
/// `omega` is the present shape with real part ≥ 0, `influence` the shares f_j. Broken bonds
/// follow the present shape: the joint's stiffness falls to the share B = Σ f b / Σ f and only the
/// remaining bonds act. Ω is taken in the hemisphere of each Ω_j.
/// Computed as {M + Σ f (1−b) Ω}/Σ f with M = Σ f b Ω_j.
#[inline(always)]
pub fn rest_shape<R: Real>(
    omega: Quaternion<R>,
    bonds: &[Remembered<R>; BondKind::COUNT],
    influence: &[R; BondKind::COUNT],
) -> Quaternion<R> {
    let zero = omega.w.lit(0.0);
    let (mut remembered, mut present, mut total) = (V3::new(zero, zero, zero), zero, zero);
    for (bond, f) in bonds.iter().zip(*influence) {
        let closed = f * bond.rate;
        let open = f - closed;
        remembered = bond.shape.scale_add(closed, remembered);
        present = present + R::select(bond.is_opposite(omega), -open, open);
        total = total + f;
    }
    let v = omega.v.scale_add(present, remembered).scale(zero.lit(1.0) / total);
    Quaternion::new(v, (zero.lit(1.0) - v.dot(v)).max(zero).sqrt())
}

/// Below this share of closed bonds a joint has no remembered shape.
pub(crate) const MIN_CLOSED_SHARE: f32 = 1e-3;

/// The equivalent of equation 15 that does not follow the present shape, for a solver in which that
/// would act as inertia: Ω* = M/B = Σ f b Ω_j / Σ f b with the remaining share of the stiffness,
/// B = Σ f b / Σ f. The equilibria are the same. With almost no closed bonds the rest shape is the
/// present one, with just enough stiffness to determine twist.
#[inline(always)]
pub(super) fn remembered<R: Real>(
    omega: Quaternion<R>,
    bonds: &[Remembered<R>; BondKind::COUNT],
    influence: &[R; BondKind::COUNT],
) -> (Quaternion<R>, R) {
    let (zero, one) = (omega.w.lit(0.0), omega.w.lit(1.0));
    let (mut sum, mut closed, mut total) = (V3::new(zero, zero, zero), zero, zero);
    for (bond, f) in bonds.iter().zip(*influence) {
        let fb = f * bond.rate;
        sum = bond.shape.scale_add(fb, sum);
        closed = closed + fb;
        total = total + f;
    }
    let few = zero.lit(MIN_CLOSED_SHARE.into());
    let share = closed / total;
    let v = sum.scale(one / closed.max(few * total));
    let open = share.lt(few);
    let v = V3::select(open, omega.v, v);
    let w = R::select(open, omega.w, (one - v.dot(v)).max(zero).sqrt());
    (Quaternion::new(v, w), share.max(few))
}

/// Equation 16: bonds of a kind that form (Δb > 0) remember the present shape,
/// Ω_j ← (b Ω_j + Δb Ω)/(b + Δb); breaking bonds keep Ω_j. b stays in \[0, 1\].
#[inline(always)]
pub fn changed<R: Real>(bond: Remembered<R>, change: R, omega: Quaternion<R>) -> Remembered<R> {
    let (zero, one) = (change.lit(0.0), change.lit(1.0));
    let to = (bond.rate + change).max(zero).min(one);
    let formed = to - bond.rate;
    let present = R::select(bond.is_opposite(omega), -formed, formed);
    // Keeps the inverse finite where there are almost no bonds.
    let least = zero.lit(1e-30);
    let mean = omega.v.scale_add(present, bond.shape.scale(bond.rate)).scale(one / to.max(least));
    Remembered { shape: V3::select(zero.lt(formed), mean, bond.shape), rate: to }
}

/// Equation 19: the change of the hydrogen bonds' rate by a wind that changed the velocity by
/// `wind` (m/s) in this substep. `per_speed` is 0.3 per m/s (the paper: 0.003 per cm/s).
#[inline]
pub fn drying(wind: f32, per_speed: f32) -> f32 {
    per_speed * wind
}

/// Equations 13 and 14 as a factor on the true stiffness: 1 at the root, 1 − `softening` where the
/// cuticle is gone. `distance` from the root (m), `damage` per length (1/m).
#[inline]
pub fn cuticle_factor(distance: f32, damage: f32, softening: f32) -> f32 {
    let cuticle = (1.0 - damage * distance).max(0.0);
    1.0 - softening * (1.0 - cuticle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_of_stiffness_left_is_that_of_closed_bonds() {
        let joint = JointBonds { rates: [0.5, 1.0, 0.0, 1.0], ..Default::default() };
        // Shares of the influences, whatever they add up to.
        for scale in [1.0, 2.0, 0.1] {
            let share = joint.closed_share(&F.map(|f| scale * f));
            assert!((share - (0.5 * 0.3 + 0.33 + 0.17)).abs() < 1e-6, "{share}");
        }
    }

    #[test]
    fn almost_no_bonds_remember_a_finite_shape() {
        for change in [1e-45_f32, 1e-40, 1e-30, 1e-20] {
            let mut joint = JointBonds { rates: [0.0; BondKind::COUNT], ..Default::default() };
            let bent = Quat::from_rotation_x(1.0);
            joint.change(0, change, bent);
            assert!(joint.is_valid(), "{change}: {joint:?}");
            joint.change(0, 0.5, bent);
            assert!(joint.shapes[0].distance(bent.xyz()) < 1e-6, "{change}: {joint:?}");
        }
    }
    use crate::solver::rod::frame::full;
    use proptest::prelude::*;

    const F: [f32; 4] = [0.3, 0.33, 0.2, 0.17];

    fn omega(v: Vec3) -> Quat {
        full(v)
    }

    #[test]
    fn fresh_bonds_rest_in_their_shape_and_broken_ones_in_the_present() {
        let shape = Vec3::new(0.1, -0.2, 0.3);
        let present = omega(Vec3::new(0.4, 0.1, 0.0));
        let mut joint = JointBonds::closed(shape);
        assert!(joint.rest_shape(present, &F).xyz().distance(shape) < 1e-6);
        joint.rates = [0.0; 4];
        assert!(joint.rest_shape(present, &F).xyz().distance(present.xyz()) < 1e-6);
        assert_eq!(joint.relaxed(&F), Vec3::ZERO);
    }

    #[test]
    fn forming_remembers_breaking_does_not() {
        let (old, new) = (Vec3::X * 0.2, Vec3::Y * 0.4);
        let mut joint = JointBonds::closed(old);
        joint.change(0, -0.75, omega(new));
        assert_eq!(joint.shapes[0], old);
        joint.change(0, 0.25, omega(new));
        assert!(joint.shapes[0].distance((old + new) * 0.5) < 1e-6);
        // clamped first: only 0.5 of the asked 9 forms
        joint.change(0, 9.0, omega(new));
        assert_eq!(joint.rates[0], 1.0);
        assert!(joint.shapes[0].distance(old * 0.25 + new * 0.75) < 1e-6);
    }

    #[test]
    fn a_remembered_half_turn_is_not_averaged_away() {
        // Darboux vectors near ±1 mean nearly the same rotation.
        let shape = Vec3::X * 0.999;
        let mut joint = JointBonds::closed(shape);
        joint.rates = [0.5; 4];
        let present = omega(Vec3::X * -0.9985);
        assert!(joint.rest_shape(present, &F).x > 0.99);
    }

    #[test]
    fn cuticle_follows_table_1() {
        assert_eq!(cuticle_factor(0.0, 0.33, 0.5764), 1.0);
        assert!((cuticle_factor(0.24, 0.33, 0.5764) - (1.0 - 0.5764 * 0.0792)).abs() < 1e-6);
        assert!((cuticle_factor(9.0, 0.33, 0.5764) - 0.4236).abs() < 1e-6);
    }

    proptest! {
        #[test]
        fn many_small_steps_remember_like_one(steps in 1usize..200, to in 0.05f32..1.0) {
            let mut once = JointBonds::closed(Vec3::X * 0.3);
            once.rates[2] = 0.0;
            let mut often = once;
            let present = omega(Vec3::new(0.0, 0.2, -0.4));
            once.change(2, to, present);
            for _ in 0..steps {
                often.change(2, to / steps as f32, present);
            }
            prop_assert!(once.shapes[2].distance(often.shapes[2]) < 1e-4);
            prop_assert!((once.rates[2] - often.rates[2]).abs() < 1e-4);
        }

        #[test]
        fn rest_shape_is_the_two_term_form(
            b in proptest::array::uniform4(0.0f32..1.0),
            s in -0.4f32..0.4, t in -0.4f32..0.4,
        ) {
            // Ω0 = M + (1−B) Ω
            let mut joint = JointBonds::closed(Vec3::new(s, 0.1, 0.0));
            joint.shapes[1] = Vec3::new(0.0, t, 0.2);
            joint.rates = b;
            let present = omega(Vec3::new(0.2, t, s));
            let m = (0..4).map(|j| F[j] * b[j] * joint.shapes[j]).sum::<Vec3>();
            let share: f32 = (0..4).map(|j| F[j] * b[j]).sum();
            let expected = m + (1.0 - share) * present.xyz();
            prop_assert!(joint.rest_shape(present, &F).xyz().distance(expected) < 1e-5);
        }
    }
}
