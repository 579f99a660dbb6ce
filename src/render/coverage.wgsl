// Strands thinner than a pixel are drawn a pixel wide and light so many of its samples as they cover
// of it (Enderton et al. 2010, "Stochastic transparency"): any number of layers, in any order, with
// depth. Which samples is drawn by lot from strand and pixel, so that all passes of a frame agree and
// a still picture stands still.
#define_import_path bevy_keratin::coverage

#import bevy_pbr::mesh_view_bindings::view

const SAMPLES: u32 = #{HAIR_SAMPLES}u;

// PCG, as in strands.wgsl.
fn scramble(seed: u32) -> u32 {
    let state = seed * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// Which samples of its pixel a strand that covers `share` of it lights.
fn covered_samples(share: f32, seed: u32, frag_coord: vec2<f32>) -> u32 {
    let pixel = vec2<u32>(frag_coord);
    // Temporal antialiasing shifts the view by parts of a pixel, each time another lot.
    let jitter = bitcast<u32>(view.clip_from_view[2].x) ^ (bitcast<u32>(view.clip_from_view[2].y) << 1u);
    let lot = scramble(seed ^ scramble(pixel.x ^ scramble(pixel.y ^ jitter)));
    let part = f32(lot >> 8u) / 16777216.0;
    let count = min(u32(max(share, 0.0) * f32(SAMPLES) + part), SAMPLES);
    let turn = lot % SAMPLES;
    let row = (1u << count) - 1u;
    return ((row << turn) | (row >> (SAMPLES - turn))) & ((1u << SAMPLES) - 1u);
}
