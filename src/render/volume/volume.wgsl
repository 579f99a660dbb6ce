// Reads how many fibres light meets on its way to a place, as march.wgsl has counted them.
#define_import_path bevy_keratin::volume

#import bevy_keratin::strands::frame
#import bevy_keratin::counts::LEFT_OUT

@group(#{MATERIAL_BIND_GROUP}) @binding(7) var volume: texture_3d<f32>;
@group(#{MATERIAL_BIND_GROUP}) @binding(8) var volume_sampler: sampler;

// What is known of a place, read once for all lights.
struct VolumePlace {
    toward: vec4<f32>,      // fibres on the way to each light, without the cells next to the place
    whole: vec4<f32>,       // on the whole way of its light through the hair
    open: vec4<f32>,        // mean direction in which it is open around, in the hair's frame, and their share
    thickness: f32,         // of the hair around, as of a plane layer (fibres)
    disarray: f32,          // of strands within about a fibre from there: mean square of the sine to their mean direction
    // Not before the kernels have been compiled.
    is_known: bool,
}

// Of a place in the hair's frame.
fn volume_place(position: vec3<f32>) -> VolumePlace {
    var out: VolumePlace;
    if frame.volume_side == 0u {
        return out;
    }
    let size = frame.volume_cell * f32(frame.volume_side);
    let at = saturate((position - frame.volume_begin) / max(size, vec3(1e-9)));
    let hair = around_at(at, vec2(0.0, 1.0));
    out.thickness = hair.x;
    out.disarray = hair.z;
    out.is_known = hair.y > 0.5;
    out.toward = toward_at(at);
    out.whole = around_at(at, vec2(0.0));
    out.open = around_at(at, vec2(1.0, 0.0));
    return out;
}

// Fibres towards the lights.
fn toward_at(place: vec3<f32>) -> vec4<f32> {
    let edge = 0.5 / f32(max(frame.volume_side, 1u));
    let z = clamp(place.z, edge, 1.0 - edge);
    return textureSampleLevel(volume, volume_sampler, vec3(place.xy, z / 1.5), 0.0);
}

// Of the grids of cells twice as large, the one at `begin`.
fn around_at(place: vec3<f32>, begin: vec2<f32>) -> vec4<f32> {
    let edge = 1.0 / f32(max(frame.volume_side, 1u));
    let at = clamp(place, vec3(edge), vec3(1.0 - edge));
    return textureSampleLevel(volume, volume_sampler, vec3(0.5 * (at.xy + begin), (1.0 + 0.5 * at.z) / 1.5), 0.0);
}

// Which of the lights in the grid this is: its place in the world and 1, or the way to it and 0. -1 for none.
fn light_in_volume(place: VolumePlace, light: vec4<f32>) -> i32 {
    let near = 1e-4 * (1.0 + dot(light.xyz, light.xyz) * light.w);
    for (var i = 0; i < 4 && place.is_known; i++) {
        let off = frame.lights[i] - light;
        if dot(off, off) < near * near {
            return i;
        }
    }
    return -1;
}

struct Fibres {
    ahead: f32,             // towards the light, without the cells next to the place
    whole: f32,             // on the whole way of the light through the hair
    near: f32,              // length of the way that is left out (m, in the hair's frame)
}

// `l`: to the light, of unit length, in the hair's frame.
fn fibres_toward(place: VolumePlace, light: i32, l: vec3<f32>) -> Fibres {
    let cells = abs(l) / max(frame.volume_cell, vec3(1e-9));
    let near = LEFT_OUT / max(max(cells.x, max(cells.y, cells.z)), 1e-9);
    return Fibres(place.toward[light], place.whole[light], near);
}
