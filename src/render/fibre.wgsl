// Light on one fibre, and what many fibres make of it. Twin in Rust: tests/drawing/fibre.rs. Keep both alike.
//
// Lobes R, TT, TRT: longitudinal from d'Eon et al. 2011, azimuthal in the real-time form of Karis
// 2016, attenuation by melanin as in Chiang et al. 2016. Among fibres: dual scattering (Zinke et al.
// 2008) with shares of one fibre, widened by every fibre that light has gone through.
#define_import_path bevy_keratin::fibre

const PI: f32 = 3.1415927;
// Tilt of the cuticle's scales as it shows in the lobes (2 degrees): R leans to the root by twice as
// much, TRT to the tip by four times.
const TILT: f32 = 0.035;
// Fresnel reflectance at normal incidence: keratin in air (1.55), keratin in water (1.165), water in
// air (1.33).
const DRY_SURFACE: f32 = 0.0465;
const WET_SURFACE: f32 = 0.0058;
const FILM_SURFACE: f32 = 0.02;
// In water light is mirrored less inside than Schlick's form says: by the exact equations at 60 degrees.
const WET_INSIDE: f32 = 0.7;
// By how much water narrows a fibre's own lobes: it fills the scales' edges, and bends light less. Light of
// many fibres keeps its spread, which is their disarray.
const WET_SLEEK: f32 = 0.17;
// Variance of the film's lobe (rad^2): it lies over the scales, smooth as the lock is straight.
const FILM_VARIANCE: f32 = 0.0064;
// Neighbours that light goes through with a fibre of a wet lock: they touch, closer than a shadow map tells
// apart. What does not go on there, their pigment takes but for a hundredth.
const LOCK_FIBRES: f32 = 3.0; // by eye, no measurement is known
// By how much more light spreads along the fibres for each that it goes through, where it has lost its way: it meets
// more of them. From tresses lit from behind.
const SCATTERED_SPREAD: f32 = 0.8;
// Variance along a fibre of light that others have sent it, by their disarray. Between two fibres that is twice as
// much. What is mirrored turns by twice the angle, of which half lies along the fibre: four times. What has gone on
// through, into any direction around, has turned by half of that.
const MIRRORED: f32 = 4.0;
const DISARRAY_SPREAD: f32 = 2.0;
// Concentrations of TT and TRT around the fibre (1/rad^2) and the light in them, after Karis.
const TT_FOCUS: f32 = 3.65;
const TRT_FOCUS: f32 = 17.0;
const TT_SHARE: f32 = 0.96;
const TRT_SHARE: f32 = 0.757;

// What a fibre is made of at one place.
struct Optics {
    absorption: vec3<f32>,  // of its pigment, by the fibre's radius
    variance: f32,          // of R's lobe along the fibre (rad^2)
    gloss: f32,             // strength of R and TRT, 1 is a clean fibre
    through: f32,           // strength of TT, 1 is a whole fibre
    wet: f32,               // 0 dry ... 1 in water
    tilt: f32,              // of this fibre's piece against the others' (rad)
    film: f32,              // strength of what the film of water reflects
    lock: f32,              // 0 by itself ... 1 among the fibres of a wet lock
    disarray: f32,          // mean square of the sine between fibres around and their mean direction
}

// How light comes to a fibre and goes to the eye.
struct Angles {
    sum: f32,               // inclination of light and of eye to the fibre's normal plane, added
    cos_i: f32,
    sin_r: f32,
    cos_r: f32,
    cos_d: f32,             // of half their difference
    cos_phi: f32,           // between both across the fibre
    cos_half: f32,
}

// Whatever length vectors have, the same is meant.
fn angles_of(t: vec3<f32>, l: vec3<f32>, v: vec3<f32>) -> Angles {
    var out: Angles;
    let sin_i = clamp(dot(t, l), -1.0, 1.0);
    out.sin_r = clamp(dot(t, v), -1.0, 1.0);
    let theta_i = asin(sin_i);
    let theta_r = asin(out.sin_r);
    out.sum = theta_i + theta_r;
    out.cos_i = cos(theta_i);
    out.cos_r = cos(theta_r);
    out.cos_d = cos(0.5 * (theta_r - theta_i));
    let across_i = l - sin_i * t;
    let across_r = v - out.sin_r * t;
    let scale = dot(across_i, across_i) * dot(across_r, across_r);
    out.cos_phi = clamp(dot(across_i, across_r) * inverseSqrt(max(scale, 1e-12)), -1.0, 1.0);
    out.cos_half = sqrt(saturate(0.5 + 0.5 * out.cos_phi));
    return out;
}

// exp(-x) I0(x) for x >= 0, within 1 %: Olivares et al. 2018.
fn bessel(x: f32) -> f32 {
    let q = x * x;
    return 0.5 * (1.0 + exp(-2.0 * x)) * (1.0 + 0.24273 * q)
        / ((1.0 + 0.43023 * q) * sqrt(sqrt(1.0 + 0.25 * q)));
}

// Light spread along the fibre around `shift`; its integral over sin theta is 1 for every variance.
fn along(a: Angles, variance: f32, shift: f32) -> f32 {
    let v = max(variance, 1e-6);
    let cos_r = max(a.cos_r * cos(shift) + a.sin_r * sin(shift), 0.0);
    return exp((cos(a.sum - shift) - 1.0) / v) * bessel(a.cos_i * cos_r / v)
        / (v * (1.0 - exp(-2.0 / v)));
}

// Light spread around the fibre: von Mises, integral 1; `c` is the cosine to the middle.
fn around(focus: f32, c: f32) -> f32 {
    return exp(focus * (c - 1.0)) / (2.0 * PI * bessel(focus));
}

// Schlick's form.
fn fresnel(f0: f32, cosine: f32) -> f32 {
    let x = 1.0 - saturate(cosine);
    return f0 + (1.0 - f0) * x * x * x * x * x;
}

// What a fibre of forward share `a_f` sends to the eye of light that has gone through `depth` fibres, a share
// `scattered` of which comes from all around its first way.
fn lobes(a: Angles, o: Optics, a_f: vec3<f32>, depth: f32, scattered: vec3<f32>) -> vec3<f32> {
    let lost = (scattered.x + scattered.y + scattered.z) / 3.0;
    let spread = depth * (0.25 * o.variance * (1.0 + SCATTERED_SPREAD * lost) + DISARRAY_SPREAD * o.disarray);
    let turned = depth / TT_FOCUS;
    let f0 = mix(DRY_SURFACE, WET_SURFACE, o.wet);
    let ratio = 1.0 / (1.19 / a.cos_d + 0.36 * a.cos_d);
    let cos_inside = sqrt(1.0 - 0.416 * a.sin_r * a.sin_r);

    // R: off the cuticle, uncoloured; off the film of water too, which has no scales.
    let grazing = a.cos_d * a.cos_half;
    let sleek = o.variance * mix(1.0, WET_SLEEK, o.wet);
    let surface = 0.25 * a.cos_half
        * (fresnel(f0, grazing) * along(a, sleek + spread, o.tilt - 2.0 * TILT)
            + o.film * fresnel(FILM_SURFACE, grazing) * along(a, FILM_VARIANCE + spread, o.tilt));

    // TT: straight through. Of the angle, this fibre's share is its own; what the surface reflects
    // away is the mean over the width, which keeps the energy at all angles. What is scattered leaves as from a matt
    // cylinder that is lit from there.
    let own = (1.0 + a.cos_phi) / (1.0 + depth) - 1.0;
    let h = sqrt(saturate(0.5 + 0.5 * own)) * (1.0 + ratio * (0.6 - 0.8 * own));
    let f_tt = fresnel(f0, 0.78 * a.cos_d);
    let cos_tt = sqrt(saturate(1.0 - h * h * ratio * ratio));
    let onward = around(1.0 / (1.0 / TT_FOCUS + turned), -a.cos_phi);
    let tt = TT_SHARE * mix(vec3(onward), vec3(matt(-a.cos_phi)), scattered * (1.0 - exp(-turned)))
        * along(a, 0.25 * sleek + spread, o.tilt + TILT) * (1.0 - f_tt) * (1.0 - f_tt)
        * exp(-2.0 * cos_tt / cos_inside * o.absorption - (1.0 - a_f) * LOCK_FIBRES * o.lock);

    // TRT: off the far wall inside, most of it at h = sqrt(3) / 2. What is mirrored depends on the eye's
    // inclination alone, as Chiang et al. have it: that skews this wide lobe.
    let f_trt = fresnel(f0, 0.5 * a.cos_r) * mix(1.0, WET_INSIDE, o.wet);
    let cos_trt = sqrt(saturate(1.0 - 0.75 * ratio * ratio));
    let trt = TRT_SHARE * around(1.0 / (1.0 / TRT_FOCUS + turned), a.cos_phi)
        * along(a, 4.0 * sleek + spread, o.tilt + 4.0 * TILT)
        * (1.0 - f_trt) * (1.0 - f_trt) * f_trt * exp(-4.0 * cos_trt / cos_inside * o.absorption);
    return o.gloss * (surface + trt) + o.through * tt;
}

// The light that a fibre sends on and back, as shares of what meets it: fits to the exact Fresnel
// equations, integrated over its width.
fn forward_share(o: Optics) -> vec3<f32> {
    return mix(0.041 + 0.868 * exp(-1.88 * o.absorption), 0.004 + 0.973 * exp(-1.63 * o.absorption), o.wet);
}

fn backward_share(o: Optics) -> vec3<f32> {
    return mix(0.034 + 0.057 * exp(-3.75 * o.absorption), 0.0044 + 0.0182 * exp(-2.8 * o.absorption), o.wet);
}

// By how much layers seem more to light that goes through them in all directions, each fibre turning it a
// little: what it meets, and what of it turns back, as diffusion has it. Of a fibre's lobes the mean cosine
// around it is 0.65, so endless light goes 1 / 0.35 fibres straight on; plane layers without pigment return
// n / (n + pi / 2 / 0.35) of it, where the two shares of a fibre alone would say n / (n + 10).
const DIFFUSE: f32 = 2.2;

// Of so many layers without pigment, how many fibres light has met that comes back. Two streams say 1 for few and
// 2 / 3 for many layers; path-traced ones have a little less.
const RETURNING: f32 = 0.56;

// What fibres one behind the other make of light, each of which sends on `a_f` and back `a_b`.
struct Bulk {
    reflectance: vec3<f32>, // of so many layers
    transmittance: vec3<f32>,
    bounces: f32,           // mean number of fibres on the way back out
    endless: vec3<f32>,     // reflectance of endless ones
    one: vec3<f32>,         // what one of endless ones lets through
}

fn bulk_of(a_f: vec3<f32>, a_b: vec3<f32>, layers: f32) -> Bulk {
    var out: Bulk;
    // Stokes 1862: endless layers first, then what is left of it by so many.
    let k = 1.0 - a_f * a_f + a_b * a_b;
    let root = sqrt(max(k * k - 4.0 * a_b * a_b, vec3(1e-6)));
    let endless = (k - root) / (2.0 * a_b);
    out.endless = endless;
    out.one = clamp(a_f / (1.0 - a_b * endless), vec3(1e-6), vec3(1.0));
    let through = pow(out.one, vec3(max(layers, 1.0)));
    let left = through * through;
    let inner = max(1.0 - endless * endless * left, vec3(1e-6));
    out.reflectance = endless * (1.0 - left) / inner;
    out.transmittance = through * (1.0 - endless * endless) / inner;
    let bounces = (1.0 + a_f * a_f - a_b * a_b) / root;
    out.bounces = 1.0 / (3.0 / (bounces.x + bounces.y + bounces.z) + 1.0 / max(RETURNING * layers, 1.0));
    return out;
}

// Light that many fibres send back, spread around them as around a matt cylinder.
fn matt(cos_phi: f32) -> f32 {
    let c = clamp(cos_phi, -1.0, 1.0);
    return ((PI - acos(c)) * c + sqrt(1.0 - c * c)) / 8.0;
}

// How light has come to a place within hair.
struct Passage {
    lit: f32,               // share that met no fibre
    depth: f32,             // fibres on the way
    // Fibres between the place and the first one on the way, where that is not 0.
    behind: f32,
}

// What flows through many layers at a place in them: a share of what comes in, on and back.
struct Flow {
    on: vec3<f32>,
    back: vec3<f32>,
}

// After `depth` of `layers`, of which there are more.
fn flow_in(bulk: Bulk, depth: f32, layers: f32) -> Flow {
    let here = pow(bulk.one, vec3(depth));
    let returned = pow(bulk.one, vec3(2.0 * layers - depth));
    let inner = max(1.0 - bulk.endless * bulk.endless * returned * here, vec3(1e-6));
    return Flow(
        (here - bulk.endless * bulk.endless * returned) / inner,
        bulk.endless * max(here - returned, vec3(0.0)) / inner,
    );
}

// Reflected share of the light that arrives by `p` in hair as thick as `layers`, where light of this direction
// meets `whole` fibres on its way through.
fn scattered(a: Angles, o: Optics, p: Passage, layers: f32, whole: f32) -> vec3<f32> {
    let a_f = forward_share(o);
    let a_b = backward_share(o);
    let bulk = bulk_of(a_f, a_b, DIFFUSE * layers);
    // The first fibre on the way lets a_f through. From there light goes straight on at first, and then all
    // ways, of which some are back: between the two.
    let within = (1.0 + p.behind) / max(whole, 1.0 + p.behind);
    let flow = flow_in(bulk, DIFFUSE * within * layers, DIFFUSE * layers);
    let straight = a_f * exp(-(1.0 - a_f) * p.behind);
    let onward = (1.0 - p.lit) * sqrt(straight * flow.on);
    let scattered = sqrt(flow.on / max(max(straight, flow.on), vec3(1e-9)));
    let back = p.lit * bulk.reflectance + (1.0 - p.lit) * flow.back;
    let own = max(1.0 - a_b / max(bulk.reflectance, a_b), vec3(0.0));
    let wide = o.variance * (1.0 + 0.25 * bulk.bounces) + MIRRORED * o.disarray * max(bulk.bounces - 1.0, 0.0);
    let body = back * own * matt(a.cos_phi) * along(a, wide, 0.0);
    return p.lit * lobes(a, o, a_f, 0.0, vec3(0.0)) + onward * lobes(a, o, a_f, p.depth, scattered) + body;
}
