// Goes through the cells towards lights and all around, and counts the fibres on the way.

#import bevy_keratin::strands::frame

@group(0) @binding(8) var density: texture_3d<f32>;
@group(0) @binding(9) var linear: sampler;
// Four grids one above the other: fibres on the way to each light, those on the whole way of its light
// through the hair, how open it is around, and how thick the hair is, with 1 where all of that is known.
@group(0) @binding(10) var volume: texture_storage_3d<rgba16float, write>;

// The cells next to a place are left out, half of the second one too.
const LEFT_OUT: f32 = 1.5;
// More fibres than any light goes through.
const ENDLESS: f32 = 1000.0;

// What a way through one place meets.
struct Met {
    fibres: f32,            // on a metre
    beside: f32,            // if they were seen from beside
    solid: f32,
}

fn met_at(place: vec3<f32>, way: vec3<f32>) -> Met {
    let side = f32(frame.volume_side);
    // The two grids of the texture do not mix.
    let z = clamp(place.z, 0.5 / side, 1.0 - 0.5 / side);
    let squares = textureSampleLevel(density, linear, vec3(place.xy, 0.5 * z), 0.0);
    let products = textureSampleLevel(density, linear, vec3(place.xy, 0.5 * z + 0.5), 0.0).xyz;
    let all = squares.x + squares.y + squares.z;
    let along = dot(squares.xyz, way * way)
        + 2.0 * dot(products, vec3(way.x * way.y, way.x * way.z, way.y * way.z));
    // All strands at the mean square of the sine.
    return Met(sqrt(max(all * (all - along), 0.0)), all, squares.w);
}

struct Count {
    all: f32,
    // Without the cells next to the place.
    far: f32,
    // All, if they were seen from beside.
    beside: f32,
    is_blocked: bool,
}

// From a place of the grid (0 ... 1) along `way` out of it, or into a solid.
fn count(place: vec3<f32>, way: vec3<f32>) -> Count {
    var out = Count(0.0, 0.0, 0.0, false);
    let cells = way / frame.volume_cell;
    let length = 1.0 / max(max(abs(cells.x), max(abs(cells.y), abs(cells.z))), 1e-9);
    let step = cells * length / f32(frame.volume_side);
    for (var i = 0u; i < frame.volume_side; i++) {
        let at = place + (f32(i) + 0.5) * step;
        if any(at < vec3(0.0)) || any(at > vec3(1.0)) {
            break;
        }
        let met = met_at(at, way);
        // What lies on a solid shares a cell with it.
        if met.solid > 0.5 && i > 0u {
            out.is_blocked = true;
            break;
        }
        let fibres = met.fibres * length;
        out.all += fibres;
        out.beside += met.beside * length;
        out.far += fibres * saturate(f32(i) + 1.0 - LEFT_OUT);
    }
    return out;
}

fn open_share(met: Count) -> f32 {
    return select(exp(-met.far), 0.0, met.is_blocked);
}

// Whether there is no hair that could be read here.
fn is_empty(place: vec3<f32>) -> bool {
    let apart = 0.75 / f32(frame.volume_side);
    for (var i = 0u; i < 8u; i++) {
        let corner = vec3(f32(i & 1u), f32((i >> 1u) & 1u), f32(i >> 2u)) * 2.0 - 1.0;
        let at = place + corner * apart;
        let z = clamp(at.z, 0.0, 1.0);
        let squares = textureSampleLevel(density, linear, vec3(at.xy, 0.5 * z), 0.0).xyz;
        if squares.x + squares.y + squares.z > 0.0 {
            return false;
        }
    }
    return true;
}

@compute @workgroup_size(4, 4, 4)
fn march(@builtin(global_invocation_id) cell: vec3<u32>) {
    let side = frame.volume_side;
    if any(cell >= vec3(side)) {
        return;
    }
    let at = vec3<i32>(cell);
    let next = vec3(0, 0, i32(side));
    let place = (vec3<f32>(cell) + 0.5) / f32(side);
    if is_empty(place) {
        textureStore(volume, at, vec4(0.0));
        textureStore(volume, at + next, vec4(0.0));
        textureStore(volume, at + 2 * next, vec4(0.0, 0.0, 0.0, 1.0));
        textureStore(volume, at + 3 * next, vec4(0.0, 1.0, 0.0, 0.0));
        return;
    }
    let here = frame.volume_begin + place * f32(side) * frame.volume_cell;
    var toward = vec4(0.0);
    var whole = vec4(0.0);
    for (var i = 0u; i < 4u; i++) {
        let light = frame.local_lights[i];
        let way = light.xyz - here * light.w;
        let square = dot(way, way);
        if square <= 0.0 {
            continue;
        }
        let l = way * inverseSqrt(square);
        let ahead = count(place, l);
        toward[i] = min(ahead.far, ENDLESS);
        whole[i] = min(ahead.all + count(place, -l).all, ENDLESS);
    }
    textureStore(volume, at, toward);
    textureStore(volume, at + next, whole);

    // To the corners and the sides of a cube, and back.
    var open = vec4(0.0);
    var thin = 0.0;
    for (var i = 0u; i < 7u; i++) {
        var d = vec3(1.0, f32(i & 1u) * 2.0 - 1.0, f32(i & 2u) - 1.0);
        if i >= 4u {
            d = vec3(f32(i == 4u), f32(i == 5u), f32(i == 6u));
        }
        d = normalize(d);
        let one = count(place, d);
        let other = count(place, -d);
        open += vec4(d, 1.0) * open_share(one) + vec4(-d, 1.0) * open_share(other);
        thin += 1.0 / clamp(one.beside + other.beside, 1e-2, ENDLESS);
    }
    textureStore(volume, at + 2 * next, open / 14.0);
    // A line goes through 1 / cosine of a plane layer: half of that is the mean of its inverse.
    textureStore(volume, at + 3 * next, vec4(min(0.5 * 7.0 / thin, ENDLESS), 1.0, 0.0, 0.0));
}
