// Strands thinner than a pixel are drawn a pixel wide and light so many of its samples as they cover
// of it (Enderton et al. 2010, "Stochastic transparency"): any number of layers, in any order, with
// depth. Which samples is a hash of strand and pixel, so that all passes of a frame agree and a still
// picture stands still.
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
//
// How many is rounded by a threshold. Those of neighbouring pixels differ as much as they can (Roberts' R2
// sequence), so that a few pixels along a strand have its mean: that is less to be seen than dots. Each
// strand goes through the sequence its own way, or strands would hide one another all along.
fn covered_samples(share: f32, seed: u32, frag_coord: vec2<f32>) -> u32 {
    // Temporal antialiasing shifts the view by parts of a pixel, each time to other thresholds.
    let jitter = bitcast<u32>(view.clip_from_view[2].x) ^ (bitcast<u32>(view.clip_from_view[2].y) << 1u);
    let own = scramble(seed ^ jitter);
    let turned = scramble(own);
    let pixel = vec2<u32>(frag_coord);
    var way = select(pixel, pixel.yx, (turned & 1u) != 0u);
    way.x = select(way.x, ~way.x, (turned & 2u) != 0u);
    let part = f32((own + way.x * 3242174889u + way.y * 2447445414u) >> 8u) / 16777216.0;
    let count = min(u32(max(share, 0.0) * f32(SAMPLES) + part), SAMPLES);
    let turn = (turned + way.y * 3242174889u + way.x * 1640531527u) >> 16u;
    let row = (1u << count) - 1u;
    let first = turn % SAMPLES;
    return ((row << first) | (row >> (SAMPLES - first))) & ((1u << SAMPLES) - 1u);
}
