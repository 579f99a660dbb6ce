// Reads how many fibres light meets on its way to a place, as march.wgsl has counted them.
#define_import_path bevy_keratin::volume

#import bevy_keratin::strands::frame

@group(#{MATERIAL_BIND_GROUP}) @binding(7) var volume: texture_3d<f32>;
@group(#{MATERIAL_BIND_GROUP}) @binding(8) var volume_sampler: sampler;

// Cells that are left out next to a place: `LEFT_OUT` of march.wgsl.
const LEFT_OUT: f32 = 1.5;

// A place in the grid.
struct VolumePlace {
    at: vec3<f32>,          // 0 ... 1
    thickness: f32,         // of the hair around, as of a plane layer (fibres)
    // Not before the kernels have been compiled.
    is_known: bool,
}

// Of a place in the hair's frame.
fn volume_place(position: vec3<f32>) -> VolumePlace {
    if frame.volume_side == 0u {
        return VolumePlace(vec3(0.5), 0.0, false);
    }
    let size = frame.volume_cell * f32(frame.volume_side);
    let at = saturate((position - frame.volume_begin) / max(size, vec3(1e-9)));
    let hair = volume_at(at, 3.0);
    return VolumePlace(at, hair.x, hair.y > 0.5);
}

fn volume_at(place: vec3<f32>, grid: f32) -> vec4<f32> {
    let side = f32(max(frame.volume_side, 1u));
    let z = clamp(place.z, 0.5 / side, 1.0 - 0.5 / side);
    return textureSampleLevel(volume, volume_sampler, vec3(place.xy, (z + grid) / 4.0), 0.0);
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
    return Fibres(volume_at(place.at, 0.0)[light], volume_at(place.at, 1.0)[light], near);
}

// The mean direction in which it is open around, in the hair's frame, and the share of directions.
fn openness(place: VolumePlace) -> vec4<f32> {
    return volume_at(place.at, 2.0);
}
