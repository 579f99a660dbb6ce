// Strands thinner than a pixel are drawn a pixel wide and light so many of its samples as they cover
// of it (Enderton et al. 2010, "Stochastic transparency"): any number of layers, in any order, with
// depth. Which samples is drawn by lot from the strand alone: a strand that lights one of four does so
// all along, a fine line and no row of dots, and stays as it is when the camera moves.
#define_import_path bevy_keratin::coverage

#import bevy_pbr::mesh_view_bindings::view

const SAMPLES: u32 = #{HAIR_SAMPLES}u;

// PCG, as in strands.wgsl.
fn scramble(seed: u32) -> u32 {
    let state = seed * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// Which samples of a pixel a strand lights that covers `share` of it.
fn covered_samples(share: f32, strand: u32) -> u32 {
    // Temporal antialiasing shifts the view by parts of a pixel, each time another lot; a shadow map
    // draws another than a camera, or what is seen would be what casts shadows.
    let jitter = bitcast<u32>(view.clip_from_view[2].x) ^ (bitcast<u32>(view.clip_from_view[2].y) << 1u);
    let lots = scramble(jitter ^ bitcast<u32>(view.viewport.z));
    // Multiples of the golden ratio, in 32 bits: any run of strands has all lots evenly.
    let part = f32((strand * 2654435769u + lots) >> 8u) / 16777216.0;
    let count = min(u32(max(share, 0.0) * f32(SAMPLES) + part), SAMPLES);
    let turn = scramble(strand ^ lots) % SAMPLES;
    let row = (1u << count) - 1u;
    return ((row << turn) | (row >> (SAMPLES - turn))) & ((1u << SAMPLES) - 1u);
}
