// A follower in a substep: its bonds, and in the tick's last one its pose, by the frames of its guides. Rust
// twins: src/simulation/lod/{follow,followers}.rs. In place of scratch it binds its guide offsets, six vectors
// a node: frame relative to each of three guides; segment in its own frame, edge of the first guide; angular
// velocity of its own, edge of the second; edge of the third.
// At the tip: guides' slots and their number; weights, and seconds since guides were assigned; guides' edges,
// and what is left of its own motion; the target of a root that has one; its frame.

fn guide_offset(i: u32, part: u32) -> vec4<f32> {
    return scratch[((first - record.first_follower_slot + i) * OFFSET_VECTORS + part) * GROUP_SIZE + lane];
}

// The frame between two edges of a guide.
fn guide_frame(of_guide: u32, last: u32, at: f32) -> vec4<f32> {
    let i = min(u32(at), last);
    let share = at - f32(i);
    let base = of_guide / GROUP_SIZE;
    let own = of_guide % GROUP_SIZE;
    let one = pose_out[((base + i) * 2u + 1u) * GROUP_SIZE + own];
    if !(0.0 < share) || last <= i {
        return one;
    }
    let next = pose_out[((base + i + 1u) * 2u + 1u) * GROUP_SIZE + own];
    return normalized(one * (1.0 - share) + next * select(share, -share, dot(one, next) < 0.0));
}

fn turned_by(rotation: vec3<f32>) -> vec4<f32> {
    let angle = sqrt(dot(rotation, rotation));
    let axis = rotation * (1.0 / max(angle, 1e-12));
    return vec4(axis * sin(0.5 * angle), cos(0.5 * angle));
}

fn follow_guides() {
    let head = guide_offset(edges, 0u);
    let weights = guide_offset(edges, 1u);
    let ends = guide_offset(edges, 2u);
    let count = min(u32(head.w), GUIDES);
    let since = weights.w + record.follow_since;
    var own_motion = since * ends.w * record.follow_decay;
    if since > OWN_LASTS * record.follow_lasts {
        own_motion = 0.0;
    }
    if (record.flags & ROOT_TARGETS) != 0u {
        set_node(0u, guide_offset(edges, 3u).xyz, 0.0);
        set_frame(edges, guide_offset(edges, 4u));
    }
    set_moving(0u, vec3(0.0), moving(0u).w);
    var p = node(0u).xyz;
    for (var i = 0u; i < edges; i++) {
        let segment = guide_offset(i, 3u);
        let spin = guide_offset(i, 4u);
        let at = vec3(segment.w, spin.w, guide_offset(i, 5u).x);
        var like = vec4(0.0, 0.0, 0.0, 1.0);
        var sum = vec4(0.0);
        for (var g = 0u; g < count; g++) {
            let frame = guide_frame(u32(head[g]), u32(ends[g]), at[g]);
            let one = product(frame, guide_offset(i, g));
            if g == 0u {
                like = one;
            }
            sum += one * select(weights[g], -weights[g], dot(like, one) < 0.0);
        }
        let square = dot(sum, sum);
        var turn = like;
        if 1u < count && 1e-3 < square {
            turn = sum * (1.0 / sqrt(square));
        }
        if own_motion != 0.0 {
            turn = product(turned_by(spin.xyz * own_motion), turn);
        }
        let before = node(i + 1u).xyz;
        let turned = product(turn, conjugate(product(record.follow_turn, frame(i))));
        let to = p + rotated(turn, segment.xyz);
        if is_broken3(to) {
            // It stays as it is.
            p = before;
            set_moving(i + 1u, vec3(0.0), 0.0);
            if spins() {
                set_spin(i, vec3(0.0));
            }
            continue;
        }
        p = to;
        let still = rotated(record.follow_turn, before) + record.follow_move;
        let v = (p - still) * (1.0 / record.follow_seconds);
        set_moving(i + 1u, select(v, vec3(0.0), is_broken3(v)), moving(i + 1u).w);
        set_node(i + 1u, p, 0.0);
        set_frame(i, turn);
        if spins() {
            let omega = turned.xyz * (select(2.0, -2.0, turned.w < 0.0) / record.follow_seconds);
            set_spin(i, select(omega, vec3(0.0), is_broken3(omega)));
        }
    }
}

@compute @workgroup_size(32)
fn follow(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) index: u32,
) {
    let block = blocks[group.x + record.first_follower_block];
    if index >= block.z {
        return;
    }
    first = block.x;
    lane = index;
    edges = block.y - 1u;
    number = block.w + index;
    let remembers = (record.flags & REMEMBERS) != 0u;
    for (var i = 0u; i <= edges; i++) {
        let p = pose_in[slot(i, 0u, 2u)].xyz;
        set_node(i, p, 0.0);
        set_frame(i, pose_in[slot(i, 1u, 2u)]);
        if (record.flags & NOTES_BEFORE) != 0u {
            motion[slot(i, 1u, 2u)] = vec4(p, 0.0);
        }
    }
    // What dries it finds it where it was.
    if remembers {
        blow();
    }
    if (record.flags & FOLLOWS) != 0u {
        follow_guides();
    }
    if remembers {
        remember();
    }
}
