// Goes through the cells towards lights and all around, and counts the fibres on the way.

#import bevy_keratin::strands::frame
#import bevy_keratin::counts::LEFT_OUT

@group(0) @binding(8) var density: texture_3d<f32>;
@group(0) @binding(9) var linear: sampler;
// Fibres on the way to each light. Above that, of cells twice as large, beside each other: fibres on the whole way
// of each light through the hair, how open it is around, and how thick the hair is, 1
// where that is known, and the strands' disarray.
@group(0) @binding(10) var volume: texture_storage_3d<rgba16float, write>;

// Disarray that parallel strands seem to have where they bend within a cell.
const BENT: f32 = 0.02;
// More fibres than any light goes through.
const ENDLESS: f32 = 1000.0;

// What a way through one place meets.
struct Met {
    fibres: f32,            // on a metre
    beside: f32,            // if they were seen from beside
    solid: f32,
    // Of these by direction.
    squares: vec3<f32>,
    products: vec3<f32>,
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
    return Met(sqrt(max(all * (all - along), 0.0)), all, squares.w, squares.xyz, products);
}

struct Count {
    all: f32,
    // Without the cells next to the place.
    far: f32,
    // All, if they were seen from beside.
    beside: f32,
    // Those by direction, the more the nearer.
    squares: vec3<f32>,
    products: vec3<f32>,
    // And times their number on a metre.
    held: f32,
    is_blocked: bool,
}

// From a place of the grid (0 ... 1) along `way` out of it, or into a solid.
fn count(place: vec3<f32>, way: vec3<f32>) -> Count {
    var out: Count;
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
        let share = exp(-out.beside) * length;
        out.squares += share * met.squares;
        out.products += share * met.products;
        out.held += share * met.beside * met.beside;
        out.all += fibres;
        out.beside += met.beside * length;
        out.far += fibres * saturate(f32(i) + 1.0 - LEFT_OUT);
    }
    return out;
}

fn open_share(met: Count) -> f32 {
    return select(exp(-met.far), 0.0, met.is_blocked);
}

// Mean square of the sine between strands and their mean direction: of their products' eigenvalues, the squares add
// up to 1 - 2 of it.
fn disarray_of(squares: vec3<f32>, products: vec3<f32>) -> f32 {
    let all = max(squares.x + squares.y + squares.z, 1e-6);
    let even = (dot(squares, squares) + 2.0 * dot(products, products)) / (all * all);
    return saturate(0.5 * (1.0 - even));
}

// Whether there is no hair near: `places` along each axis are looked at, three quarters of a cell beside it or, of
// three, one and a half.
fn is_empty(place: vec3<f32>, places: u32) -> bool {
    let side = f32(frame.volume_side);
    for (var i = 0u; i < places * places * places; i++) {
        let corner = vec3(i % places, (i / places) % places, i / (places * places));
        let at = place + 1.5 * (vec3<f32>(corner) - 0.5 * f32(places - 1u)) / side;
        let z = clamp(at.z, 0.5 / side, 1.0 - 0.5 / side);
        let squares = textureSampleLevel(density, linear, vec3(at.xy, 0.5 * z), 0.0).xyz;
        if squares.x + squares.y + squares.z > 0.0 {
            return false;
        }
    }
    return true;
}

// The way from a place of the grid to a light, of unit length; zero where there is none.
fn way_to(light: u32, place: vec3<f32>) -> vec3<f32> {
    let light_at = frame.local_lights[light];
    let here = frame.volume_begin + place * f32(frame.volume_side) * frame.volume_cell;
    let way = light_at.xyz - here * light_at.w;
    let square = dot(way, way);
    return select(vec3(0.0), way * inverseSqrt(square), square > 0.0);
}

@compute @workgroup_size(4, 4, 4)
fn march(@builtin(global_invocation_id) cell: vec3<u32>) {
    let side = frame.volume_side;
    if any(cell >= vec3(side)) {
        return;
    }
    let place = (vec3<f32>(cell) + 0.5) / f32(side);
    var toward = vec4(0.0);
    if !is_empty(place, 2u) {
        for (var i = 0u; i < 4u; i++) {
            let l = way_to(i, place);
            if any(l != vec3(0.0)) {
                toward[i] = min(count(place, l).far, ENDLESS);
            }
        }
    }
    textureStore(volume, vec3<i32>(cell), toward);
}

// What differs little from cell to cell.
@compute @workgroup_size(4, 4, 4)
fn march_around(@builtin(global_invocation_id) cell: vec3<u32>) {
    let half_side = frame.volume_side / 2u;
    if any(cell >= vec3(half_side)) {
        return;
    }
    let place = (vec3<f32>(cell) + 0.5) / f32(half_side);
    var whole = vec4(0.0);
    var open = vec4(0.0, 0.0, 0.0, 14.0);
    var thickness = 0.0;
    var disarray = 0.0;
    if !is_empty(place, 3u) {
        for (var i = 0u; i < 4u; i++) {
            let l = way_to(i, place);
            if any(l != vec3(0.0)) {
                whole[i] = min(count(place, l).all + count(place, -l).all, ENDLESS);
            }
        }
        // To the corners and the sides of a cube, and back.
        open = vec4(0.0);
        var thin = 0.0;
        var squares = vec3(0.0);
        var products = vec3(0.0);
        var held = 0.0;
        for (var i = 0u; i < 7u; i++) {
            var d = vec3(1.0, f32(i & 1u) * 2.0 - 1.0, f32(i & 2u) - 1.0);
            if i >= 4u {
                d = vec3(f32(i == 4u), f32(i == 5u), f32(i == 6u));
            }
            d = normalize(d);
            let one = count(place, d);
            let other = count(place, -d);
            open += vec4(d, 1.0) * open_share(one) + vec4(-d, 1.0) * open_share(other);
            squares += one.squares + other.squares;
            products += one.products + other.products;
            held += one.held + other.held;
            thin += 1.0 / clamp(one.beside + other.beside, 1e-2, ENDLESS);
        }
        // A line goes through 1 / cosine of a plane layer: half of that is the mean of its inverse.
        thickness = min(0.5 * 7.0 / thin, ENDLESS);
        // Where a cell holds many fibres, light meets only those next to each other, which differ less than all of the
        // cell do: by the square of how far they are apart.
        let size = frame.volume_cell;
        held *= pow(size.x * size.y * size.z, 1.0 / 3.0) / max(squares.x + squares.y + squares.z, 1e-6);
        disarray = max(disarray_of(squares, products) - BENT, 0.0) / (1.0 + held * held);
    }
    let at = vec3<i32>(cell) + vec3(0, 0, i32(frame.volume_side));
    let next = i32(half_side);
    textureStore(volume, at, whole);
    textureStore(volume, at + vec3(next, 0, 0), open / 14.0);
    textureStore(volume, at + vec3(0, next, 0), vec4(thickness, 1.0, disarray, 0.0));
}
