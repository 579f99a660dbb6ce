//! Scattering by one fibre and by many: a twin of `src/render/fibre.wgsl`, which names the sources of the
//! formulas, and what both must obey.

use bevy::prelude::*;
use bevy_keratin::prelude::*;
use core::f32::consts::PI;

const TILT: f32 = 0.035;
const DRY_SURFACE: f32 = 0.0465;
const WET_SURFACE: f32 = 0.0058;
const FILM_SURFACE: f32 = 0.02;
const FILM_VARIANCE: f32 = 0.0064;
const LOCK_FIBRES: f32 = 3.0;
const WET_INSIDE: f32 = 0.7;
const WET_SLEEK: f32 = 0.17;
const SCATTERED_SPREAD: f32 = 0.8;
const MIRRORED: f32 = 4.0;
const DISARRAY_SPREAD: f32 = 2.0;
const TT_FOCUS: f32 = 3.65;
const TRT_FOCUS: f32 = 17.0;
const TT_SHARE: f32 = 0.96;
const TRT_SHARE: f32 = 0.757;
const DIFFUSE: f32 = 2.2;
const RETURNING: f32 = 0.56;

/// Optical properties of a fibre at one point.
#[derive(Clone, Copy, Debug)]
pub struct Optics {
    /// Absorption of its pigment, per radius of the fibre.
    pub absorption: Vec3,
    /// Variance of R's lobe along the fibre (rad²).
    pub variance: f32,
    /// Strength of R and TRT; 1 is a clean fibre.
    pub gloss: f32,
    /// Strength of TT; 1 is a whole fibre.
    pub through: f32,
    /// 0 dry … 1 in water.
    pub wet: f32,
    /// Random tilt of this piece of fibre (rad).
    pub tilt: f32,
    /// Strength of what the film of water reflects.
    pub film: f32,
    /// 0 by itself … 1 among the fibres of a wet lock, whose neighbours its light goes through as well.
    pub lock: f32,
    /// Mean square of the sine between the fibres around and their mean direction.
    pub disarray: f32,
}

impl Optics {
    /// A clean, dry, straight fibre; `roughness` as in [`HairLook`](HairLook).
    pub fn new(absorption: Vec3, roughness: f32) -> Self {
        Self {
            absorption,
            variance: roughness.powi(4),
            gloss: 1.0,
            through: 1.0,
            wet: 0.0,
            tilt: 0.0,
            film: 0.0,
            lock: 0.0,
            disarray: 0.0,
        }
    }

    /// The forward-scattered share of incident light.
    pub fn forward_share(&self) -> Vec3 {
        let dry = 0.041 + 0.868 * (-1.88 * self.absorption).exp();
        dry.lerp(0.004 + 0.973 * (-1.63 * self.absorption).exp(), self.wet)
    }

    /// The backward-scattered share of incident light.
    pub fn backward_share(&self) -> Vec3 {
        let dry = 0.034 + 0.057 * (-3.75 * self.absorption).exp();
        dry.lerp(0.0044 + 0.0182 * (-2.8 * self.absorption).exp(), self.wet)
    }

    /// The share of light that is scattered to the eye, after it has passed through `depth` fibres; a share
    /// `scattered` of it comes from all around its first way.
    pub fn lobes(&self, a: &Angles, depth: f32, scattered: Vec3) -> Vec3 {
        let lerp = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let lost = scattered.element_sum() / 3.0;
        let spread = depth
            * (0.25 * self.variance * (1.0 + SCATTERED_SPREAD * lost)
                + DISARRAY_SPREAD * self.disarray);
        let turned = depth / TT_FOCUS;
        let f0 = lerp(DRY_SURFACE, WET_SURFACE, self.wet);
        let ratio = 1.0 / (1.19 / a.cos_d + 0.36 * a.cos_d);
        let cos_inside = (1.0 - 0.416 * a.sin_r * a.sin_r).sqrt();

        let grazing = a.cos_d * a.cos_half;
        let sleek = self.variance * lerp(1.0, WET_SLEEK, self.wet);
        let surface = 0.25
            * a.cos_half
            * (fresnel(f0, grazing) * a.along(sleek + spread, self.tilt - 2.0 * TILT)
                + self.film
                    * fresnel(FILM_SURFACE, grazing)
                    * a.along(FILM_VARIANCE + spread, self.tilt));

        let own = (1.0 + a.cos_phi) / (1.0 + depth) - 1.0;
        let h = (0.5 + 0.5 * own).clamp(0.0, 1.0).sqrt() * (1.0 + ratio * (0.6 - 0.8 * own));
        let f_tt = fresnel(f0, 0.78 * a.cos_d);
        let cos_tt = (1.0 - h * h * ratio * ratio).clamp(0.0, 1.0).sqrt();
        let onward = Vec3::splat(around(1.0 / (1.0 / TT_FOCUS + turned), -a.cos_phi));
        let scattered = scattered * (1.0 - (-turned).exp());
        let tt = TT_SHARE
            * (onward * (1.0 - scattered) + matt(-a.cos_phi) * scattered)
            * a.along(0.25 * sleek + spread, self.tilt + TILT)
            * (-(1.0 - self.forward_share()) * LOCK_FIBRES * self.lock).exp()
            * (1.0 - f_tt).powi(2)
            * (-2.0 * cos_tt / cos_inside * self.absorption).exp();

        // Of the eye's inclination alone, as Chiang et al. have it: that skews this wide lobe.
        let f_trt = fresnel(f0, 0.5 * a.cos_r) * lerp(1.0, WET_INSIDE, self.wet);
        let cos_trt = (1.0 - 0.75 * ratio * ratio).clamp(0.0, 1.0).sqrt();
        let trt = TRT_SHARE
            * around(1.0 / (1.0 / TRT_FOCUS + turned), a.cos_phi)
            * a.along(4.0 * sleek + spread, self.tilt + 4.0 * TILT)
            * (1.0 - f_trt).powi(2)
            * f_trt
            * (-4.0 * cos_trt / cos_inside * self.absorption).exp();
        self.gloss * (surface + trt) + self.through * tt
    }

    /// Multiple scattering: the reflected share of light that arrives along `p` in hair of `layers`
    /// layers, where light of this direction meets `whole` fibres on its way through.
    pub fn scattered(&self, a: &Angles, p: &Passage, layers: f32, whole: f32) -> Vec3 {
        let (a_f, a_b) = (self.forward_share(), self.backward_share());
        let bulk = Bulk::of(a_f, a_b, DIFFUSE * layers);
        let within = (1.0 + p.behind) / whole.max(1.0 + p.behind);
        let flow = bulk.flow(DIFFUSE * within * layers, DIFFUSE * layers);
        let straight = a_f * (-(1.0 - a_f) * p.behind).exp();
        let onward = (1.0 - p.lit) * (straight * flow.on).map(f32::sqrt);
        let back = p.lit * bulk.reflectance + (1.0 - p.lit) * flow.back;
        let own = (1.0 - a_b / bulk.reflectance.max(a_b)).max(Vec3::ZERO);
        let scattered = (flow.on / straight.max(flow.on).max(Vec3::splat(1e-9))).map(f32::sqrt);
        let wide = self.variance * (1.0 + 0.25 * bulk.bounces)
            + MIRRORED * self.disarray * (bulk.bounces - 1.0).max(0.0);
        p.lit * self.lobes(a, 0.0, Vec3::ZERO)
            + onward * self.lobes(a, p.depth, scattered)
            + back * own * matt(a.cos_phi) * a.along(wide, 0.0)
    }
}

/// Directions of light and eye relative to a fibre.
#[derive(Clone, Copy, Debug)]
pub struct Angles {
    sum: f32,
    cos_i: f32,
    sin_r: f32,
    cos_r: f32,
    cos_d: f32,
    cos_phi: f32,
    cos_half: f32,
}

impl Angles {
    /// Of the tangent `t` toward the tip, `l` to the light and `v` to the eye, all of length 1.
    pub fn of(t: Vec3, l: Vec3, v: Vec3) -> Self {
        let sin_i = t.dot(l).clamp(-1.0, 1.0);
        let sin_r = t.dot(v).clamp(-1.0, 1.0);
        let (theta_i, theta_r) = (sin_i.asin(), sin_r.asin());
        let (across_i, across_r) = (l - sin_i * t, v - sin_r * t);
        let scale = across_i.length_squared() * across_r.length_squared();
        let cos_phi = (across_i.dot(across_r) / scale.max(1e-12).sqrt()).clamp(-1.0, 1.0);
        Self {
            sum: theta_i + theta_r,
            cos_i: theta_i.cos(),
            sin_r,
            cos_r: theta_r.cos(),
            cos_d: (0.5 * (theta_r - theta_i)).cos(),
            cos_phi,
            cos_half: (0.5 + 0.5 * cos_phi).clamp(0.0, 1.0).sqrt(),
        }
    }

    fn along(&self, variance: f32, shift: f32) -> f32 {
        let v = variance.max(1e-6);
        let cos_r = (self.cos_r * shift.cos() + self.sin_r * shift.sin()).max(0.0);
        (((self.sum - shift).cos() - 1.0) / v).exp() * bessel(self.cos_i * cos_r / v)
            / (v * (1.0 - (-2.0 / v).exp()))
    }
}

fn bessel(x: f32) -> f32 {
    let q = x * x;
    0.5 * (1.0 + (-2.0 * x).exp()) * (1.0 + 0.24273 * q)
        / ((1.0 + 0.43023 * q) * (1.0 + 0.25 * q).sqrt().sqrt())
}

fn around(focus: f32, c: f32) -> f32 {
    (focus * (c - 1.0)).exp() / (2.0 * PI * bessel(focus))
}

fn fresnel(f0: f32, cosine: f32) -> f32 {
    f0 + (1.0 - f0) * (1.0 - cosine.clamp(0.0, 1.0)).powi(5)
}

fn matt(cos_phi: f32) -> f32 {
    let c = cos_phi.clamp(-1.0, 1.0);
    ((PI - c.acos()) * c + (1.0 - c * c).sqrt()) / 8.0
}

/// Multiple scattering in layers of fibres.
#[derive(Clone, Copy, Debug)]
pub struct Bulk {
    /// Reflectance of the layers.
    pub reflectance: Vec3,
    /// What comes through them.
    pub transmittance: Vec3,
    /// Mean number of fibres on the way back out.
    pub bounces: f32,
    /// Reflectance of endless layers.
    endless: Vec3,
    /// What one of endless layers lets through.
    one: Vec3,
}

/// What flows through many layers at a place in them: a share of what comes in, on and back.
#[derive(Clone, Copy, Debug)]
pub struct Flow {
    /// As light came in.
    pub on: Vec3,
    /// The other way.
    pub back: Vec3,
}

impl Bulk {
    /// For `layers` layers, each of which transmits `a_f` and reflects `a_b`.
    pub fn of(a_f: Vec3, a_b: Vec3, layers: f32) -> Self {
        let k = 1.0 - a_f * a_f + a_b * a_b;
        let root = (k * k - 4.0 * a_b * a_b).max(Vec3::splat(1e-6)).map(f32::sqrt);
        let endless = (k - root) / (2.0 * a_b);
        let one = a_f / (1.0 - a_b * endless);
        let one = one.clamp(Vec3::splat(1e-6), Vec3::ONE);
        let through = (layers.max(1.0) * one.map(f32::ln)).exp();
        let left = through * through;
        let inner = (1.0 - endless * endless * left).max(Vec3::splat(1e-6));
        let bounces = ((1.0 + a_f * a_f - a_b * a_b) / root).element_sum();
        Self {
            reflectance: endless * (1.0 - left) / inner,
            transmittance: through * (1.0 - endless * endless) / inner,
            bounces: 1.0 / (3.0 / bounces + 1.0 / (RETURNING * layers).max(1.0)),
            endless,
            one,
        }
    }

    /// After `depth` of `layers`, of which there are more (Stokes 1862).
    pub fn flow(&self, depth: f32, layers: f32) -> Flow {
        let [here, returned] = [depth, 2.0 * layers - depth].map(|n| self.one.powf(n));
        let square = self.endless * self.endless;
        let inner = (1.0 - square * returned * here).max(Vec3::splat(1e-6));
        Flow {
            on: (here - square * returned) / inner,
            back: self.endless * (here - returned).max(Vec3::ZERO) / inner,
        }
    }
}

/// The path of light to a point within hair.
#[derive(Clone, Copy, Debug)]
pub struct Passage {
    /// The share that hit no fibre.
    pub lit: f32,
    /// Number of fibres on the path.
    pub depth: f32,
    /// Fibres between the point and the first one on the path, where that is not 0.
    pub behind: f32,
}

const ALONG: u32 = 4000;
const AROUND: u32 = 180;

/// The mean over all directions of light, evenly in sin θ and φ, times the sphere's 4π; the eye
/// at `theta` from the fibre's normal plane. `y` is the fibre.
fn over_all_light(theta: f32, f: impl Fn(&Angles) -> Vec3) -> Vec3 {
    let eye = Vec3::new(theta.cos(), theta.sin(), 0.0);
    let mut sum = bevy::math::DVec3::ZERO;
    for i in 0..ALONG {
        let y = 2.0 * (i as f32 + 0.5) / ALONG as f32 - 1.0;
        let flat = (1.0 - y * y).sqrt();
        for j in 0..AROUND {
            let (sin, cos) = (PI * (j as f32 + 0.5) / AROUND as f32).sin_cos();
            let light = Vec3::new(flat * cos, y, flat * sin);
            sum += f(&Angles::of(Vec3::Y, light, eye)).as_dvec3();
        }
    }
    sum.as_vec3() * (4.0 * PI / (ALONG * AROUND) as f32)
}

pub fn a_wet_lock_is_darker_than_dry_hair_wherever_light_comes_from() {
    // Brown: what comes to a place in the open, and behind some fibres, from all around.
    let absorption = Vec3::new(0.46, 0.77, 1.51);
    let [open, behind] = [(1.0, 0.0), (0.0, 3.0)].map(|(lit, behind)| Passage {
        lit,
        depth: 4.0 * (1.0 - lit),
        behind,
    });
    for passage in [open, behind] {
        for degrees in (0..=180).step_by(30) {
            let (sine, cosine) = (degrees as f32).to_radians().sin_cos();
            let angles = Angles::of(Vec3::X, Vec3::new(0.0, sine, cosine), Vec3::Z);
            let [dry, single, lock] = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)].map(|(wet, lock)| {
                let fibre = Optics { wet, lock, ..Optics::new(absorption, 0.3) };
                fibre.scattered(&angles, &passage, 20.0, 30.0).element_sum()
            });
            assert!(lock < 0.75 * dry, "{passage:?}, {degrees}°: {lock} of {dry}");
            assert!(lock <= single, "{passage:?}, {degrees}°: {lock} of {single}");
        }
    }
}

pub fn what_flows_through_layers_begins_as_all_and_ends_as_what_comes_through() {
    for absorption in [0.0, 0.05, 0.4, 2.0] {
        let fibre = Optics::new(Vec3::splat(absorption), 0.3);
        let bulk = Bulk::of(fibre.forward_share(), fibre.backward_share(), 8.0);
        let near = |a: Vec3, b: Vec3| assert!(a.abs_diff_eq(b, 2e-3), "{absorption}: {a} {b}");
        near(bulk.flow(0.0, 8.0).on, Vec3::ONE);
        near(bulk.flow(0.0, 8.0).back, bulk.reflectance);
        near(bulk.flow(8.0, 8.0).on, bulk.transmittance);
        near(bulk.flow(8.0, 8.0).back, Vec3::ZERO);
        // What goes in more than comes out is absorbed on the way, without pigment nothing is.
        let net = |depth: f32| bulk.flow(depth, 8.0).on - bulk.flow(depth, 8.0).back;
        let lost = (0..8).map(|i| net(i as f32) - net(i as f32 + 1.0));
        let lost: Vec<f32> = lost.map(|lost| lost.x).collect();
        let least = if absorption > 0.0 { 0.0 } else { -1e-3 };
        assert!(lost.iter().all(|lost| *lost > least), "{absorption}: {lost:?}");
        if absorption == 0.0 {
            assert!(lost.iter().all(|lost| *lost < 5e-3), "{lost:?}");
        }
    }
}

pub fn a_fibre_conserves_energy_and_pigment_only_absorbs() {
    for roughness in [0.15, 0.38, 0.6] {
        for degrees in [0.0f32, 20.0, 45.0, 60.0] {
            let theta = degrees.to_radians();
            let sent = |absorption: Vec3| {
                let fibre = Optics::new(absorption, roughness);
                over_all_light(theta, |a| fibre.lobes(a, 0.0, Vec3::ZERO))
            };
            let white = sent(Vec3::ZERO).x;
            println!("roughness {roughness}, {degrees}°: {white:.3}");
            assert!((0.75..=1.10).contains(&white), "{white} at {degrees}°, {roughness}");
            if degrees == 0.0 {
                assert!((white - 1.0).abs() < 0.02, "{white}");
            }
            for melanin in [Melanin::PLATINUM, Melanin::RED, Melanin::BLACK] {
                let colour = sent(melanin.absorption());
                assert!(colour.max_element() < white && colour.min_element() > 0.0);
            }
        }
    }
}

pub fn shares_of_one_fibre_are_those_of_its_lobes() {
    for melanin in [Melanin::new(0.0, 0.0), Melanin::BLOND, Melanin::BROWN, Melanin::BLACK] {
        let fibre = Optics::new(melanin.absorption(), 0.5);
        let half = |sign: f32| {
            over_all_light(0.0, |a| {
                if a.cos_phi * sign > 0.0 { fibre.lobes(a, 0.0, Vec3::ZERO) } else { Vec3::ZERO }
            })
        };
        let (on, back) = (half(-1.0), half(1.0));
        println!(
            "{melanin:?}: on {on} for {}, back {back} for {}",
            fibre.forward_share(),
            fibre.backward_share()
        );
        assert!((on - fibre.forward_share()).abs().max_element() < 0.03);
        assert!((back - fibre.backward_share()).abs().max_element() < 0.012);
    }
}

pub fn light_that_went_through_others_is_spread_not_added() {
    let fibre = Optics::new(Vec3::ZERO, 0.38);
    let among = Optics { disarray: 0.1, ..fibre };
    for depth in [0.5, 2.0, 10.0] {
        for (fibre, scattered) in [(fibre, 0.0), (fibre, 1.0), (among, 0.5)] {
            let sent = over_all_light(0.3, |a| fibre.lobes(a, depth, Vec3::splat(scattered))).x;
            assert!((0.9..=1.1).contains(&sent), "{sent} after {depth} fibres, {scattered}");
        }
    }
}

pub fn among_fibres_that_point_elsewhere_light_leaves_its_cone() {
    // Light 50° from where parallel fibres mirror it to the eye, in the open and behind some.
    let angles = Angles::of(Vec3::Y, Vec3::new(0.0, 0.766, 0.643), Vec3::Z);
    for (lit, behind) in [(1.0, 0.0), (0.0, 4.0)] {
        let passage = Passage { lit, depth: (1.0 - lit) * (1.0 + behind), behind };
        let sent = |disarray: f32| {
            let fibre = Optics { disarray, ..Optics::new(Vec3::ZERO, 0.4) };
            fibre.scattered(&angles, &passage, 8.0, 8.0).x
        };
        assert!(sent(0.05) > 1.5 * sent(0.0), "{} of {}", sent(0.05), sent(0.0));
    }
}

pub fn infinitely_deep_hair_has_the_colour_of_its_melanin() {
    // Chiang et al. 2016, equation 9, has no surface reflection, which adds 0.034.
    for melanin in [Melanin::PLATINUM, Melanin::BLOND, Melanin::BROWN] {
        let fibre = Optics::new(melanin.absorption(), 0.5);
        let bulk = Bulk::of(fibre.forward_share(), fibre.backward_share(), 1e3);
        let chiang = Vec3::from(melanin.color().to_f32_array_no_alpha());
        println!("{melanin:?}: {} for {chiang}", bulk.reflectance);
        assert!((bulk.reflectance - chiang).min_element() > -0.01);
        assert!((bulk.reflectance - chiang).max_element() < 0.04);
    }
    let white = Optics::new(Vec3::ZERO, 0.5);
    let of = |layers| Bulk::of(white.forward_share(), white.backward_share(), layers);
    assert!((0.98..=1.0).contains(&of(1e4).reflectance.x));
    assert!((of(1.0).reflectance - white.backward_share()).abs().max_element() < 1e-3);
    assert!(of(5.0).reflectance.x < of(20.0).reflectance.x);
    for layers in [1.0, 3.0, 30.0] {
        let bulk = of(layers);
        let sum = bulk.reflectance.x + bulk.transmittance.x;
        assert!((0.97..=1.001).contains(&sum), "{sum}: without pigment nothing is lost");
    }
}

pub fn layers_without_pigment_return_what_diffusion_returns() {
    let white = Optics::new(Vec3::ZERO, 0.5);
    // The mean cosine of a fibre's lobes around it, 1 straight on.
    let cosine = over_all_light(0.0, |a| white.lobes(a, 0.0, Vec3::ZERO) * -a.cos_phi).x;
    println!("mean cosine {cosine:.3}");
    let (a_f, a_b) = (white.forward_share(), white.backward_share());
    for layers in [2.0, 4.8, 20.0] {
        let ours = Bulk::of(a_f, a_b, DIFFUSE * layers).reflectance.x;
        let truth = layers / (layers + 0.5 * PI / (1.0 - cosine));
        println!("{layers} layers: {ours:.3} for {truth:.3}");
        assert!((ours - truth).abs() < 0.03, "{ours} for {truth}");
    }
}

/// Where on a cylinder along x light from `elevation` (degrees above the eye's axis) is sent most, in
/// degrees of the normal; strands go around it, roots on top.
fn place_of_peak(elevation: f32, look: impl Fn(&Angles) -> f32) -> f32 {
    let (sin, cos) = elevation.to_radians().sin_cos();
    let light = Vec3::new(0.0, sin, cos);
    let sent = (-200..=800).map(|i| 0.1 * i as f32).map(|degrees| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        (look(&Angles::of(Vec3::new(0.0, -cos, sin), light, Vec3::Z)), degrees)
    });
    sent.reduce(|a, b| if b.0 > a.0 { b } else { a }).unwrap().1
}

pub fn highlights_on_a_cylinder_lie_where_path_tracing_has_them() {
    // Cycles' roughness 0.3 and offset 2°, light 40° above, one bounce.
    let of = |absorption| Optics { variance: 0.0846, ..Optics::new(absorption, 0.5) };
    let (clear, blond) = (of(Vec3::splat(50.0)), of(Melanin::new(0.127, 0.0).absorption()));
    let first = place_of_peak(40.0, |a| clear.lobes(a, 0.0, Vec3::ZERO).y);
    let second = place_of_peak(40.0, |a| {
        (blond.lobes(a, 0.0, Vec3::ZERO) - clear.lobes(a, 0.0, Vec3::ZERO)).y
    });
    println!("R at {first:.1}° for 18.0°, coloured light at {second:.1}° for 29.5°");
    assert!((first - 18.0).abs() < 2.0, "{first}");
    assert!((second - 29.5).abs() < 2.0, "{second}");
}

/// Where on a fibre whose eye is at `eye` (radians from its normal plane) light is sent most, as
/// the half angle between light and eye.
fn peak(look: impl Fn(&Angles) -> f32) -> f32 {
    let to = |angle: f32| Vec3::new(angle.cos(), angle.sin(), 0.0);
    let steps = (-4000..=4000).map(|i| i as f32 * 1e-4);
    let sent = steps.map(|light| (look(&Angles::of(Vec3::Y, to(light), Vec3::X)), light));
    let (_, light) = sent.reduce(|a, b| if b.0 > a.0 { b } else { a }).unwrap();
    (0.5 * light).to_degrees()
}

pub fn the_clear_highlight_leans_to_the_root_and_the_coloured_one_to_the_tip() {
    // The path-traced references: the half vector leans by the tilt of 2°, TRT by twice that.
    let black = Optics::new(Vec3::splat(50.0), 0.3);
    let clear = peak(|a| black.lobes(a, 0.0, Vec3::ZERO).y);
    let blond = Optics::new(Melanin::BLOND.absorption(), 0.3);
    let coloured = peak(|a| (blond.lobes(a, 0.0, Vec3::ZERO) - black.lobes(a, 0.0, Vec3::ZERO)).y);
    println!("R {clear}°, TRT {coloured}°");
    assert!((clear + 2.0).abs() < 1.0 && (coloured - 4.0).abs() < 1.5);
    let back = Angles::of(Vec3::Y, Vec3::X, Vec3::X);
    let (r, all) = (black.lobes(&back, 0.0, Vec3::ZERO), blond.lobes(&back, 0.0, Vec3::ZERO));
    assert!((r.x - r.z).abs() < 1e-6, "R has no colour");
    assert!((all - r).x > 1.5 * (all - r).z, "TRT has the pigment's");
}

pub fn all_results_are_finite_for_any_fibre_and_light() {
    let ways = [Vec3::X, Vec3::Y, Vec3::NEG_Y, Vec3::new(0.6, 0.8, 0.0), Vec3::Z];
    for absorption in [0.0, 1e-9, 3.0, 1e3, 1e6] {
        for roughness in [0.05, 0.4, 1.0] {
            for wet in [0.0, 1.0] {
                let dry = Optics::new(Vec3::splat(absorption), roughness);
                let fibre = Optics { wet, film: wet, disarray: 0.3 * wet, ..dry };
                for (l, v) in ways.iter().flat_map(|l| ways.map(|v| (*l, v))) {
                    for (lit, depth, behind) in [(1.0, 0.0, 0.0), (0.0, 1e6, 1e6), (0.5, 2.0, 1.0)]
                    {
                        let passage = Passage { lit, depth, behind };
                        let sent =
                            fibre.scattered(&Angles::of(Vec3::Y, l, v), &passage, 20.0, 30.0);
                        assert!(sent.is_finite() && sent.min_element() >= 0.0, "{sent}");
                    }
                }
            }
        }
    }
}
