// Makes a texture of the counts in cells, and clears them for the next hair.

#import bevy_keratin::strands::{frame, DrawnSolid}
#import bevy_keratin::counts::UNIT

@group(0) @binding(7) var<storage, read_write> cells: array<i32>;
// Two grids one above the other: blocked area by volume (1/m) times the squares of the direction, and whether a
// solid is there; then times the products.
@group(0) @binding(8) var density: texture_storage_3d<rgba16float, write>;

// Whether a place is deeper inside than `within` (m): strands on a solid share cells with what is below its
// surface.
fn is_in(solid: DrawnSolid, place: vec4<f32>, within: f32) -> bool {
    if solid.half < 0.0 {
        return false;
    }
    let own = vec3(dot(solid.x, place), dot(solid.y, place), dot(solid.z, place));
    let off = own - vec3(0.0, clamp(own.y, -solid.half, solid.half), 0.0);
    let unit = max(length(solid.x.xyz), max(length(solid.y.xyz), length(solid.z.xyz)));
    return 1.0 - length(off) > within * unit;
}

@compute @workgroup_size(4, 4, 4)
fn settle(@builtin(global_invocation_id) cell: vec3<u32>) {
    let side = frame.volume_side;
    if any(cell >= vec3(side)) {
        return;
    }
    let begin = 6u * ((cell.z * side + cell.y) * side + cell.x);
    let size = frame.volume_cell;
    let deep = pow(size.x * size.y * size.z, 1.0 / 3.0);
    var values = array<f32, 6>();
    for (var i = 0u; i < 6u; i++) {
        values[i] = clamp(f32(cells[begin + i]) / (UNIT * deep), -65504.0, 65504.0);
        cells[begin + i] = 0;
    }
    let place = vec4(frame.volume_begin + (vec3<f32>(cell) + 0.5) * size, 1.0);
    var solid = 0.0;
    for (var i = 0u; i < min(frame.solid_count, 16u); i++) {
        if is_in(frame.solids[i], place, deep) {
            solid = 1.0;
        }
    }
    let at = vec3<i32>(cell);
    textureStore(density, at, vec4(values[0], values[1], values[2], solid));
    textureStore(density, at + vec3(0, 0, i32(side)), vec4(values[3], values[4], values[5], 0.0));
}
