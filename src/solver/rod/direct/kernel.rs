//! One Newton step of a strand: down the strand to assemble and eliminate, up to solve.
//!
//! With e_i the vector of edge i, t_i its frame's tangent and r_i = 1/|e_i|, a displacement turns the
//! edge by δφ_i = t_i × δe_i r_i. Energies: ½ (EA/l)(|e| − l)² of an edge, that of [`moment`] of a joint, of which the
//! moment is the exact gradient and whose Gauss–Newton Hessian is that of ½K|δφ_j − δφ_{j−1}|².

use super::{
    frames::{
        Torsion, choose, moment, parallel_transport, turned_by_e3, turned_since, twist_stiffness,
    },
    matrix::{Matrix, Pivot, Symmetric},
    row::DirectRow,
    width::Width,
};
use crate::{
    base::lanes::{Quaternion, Real, V3},
    solver::rod::{
        block::{EdgeLanes, NodeLanes},
        limiter::{HOLD, MAX_TENSION, TOLERANCE},
        tridiagonal::{Elimination, back},
    },
};

/// Values that all nodes of a strand share.
#[derive(Clone, Copy)]
pub(crate) struct NewtonStage<R> {
    /// Where in the substep forces are evaluated.
    pub theta: R,
    /// θ dt (s).
    pub ahead: R,
    /// Factor from the solution at θ to the end of the substep: 1/θ.
    pub beyond: R,
    /// Rotation of the scalp's frame up to θ.
    pub root_turn: V3<R>,
    /// Largest twist that counts in the Hessian, as a moment over EI (1/m).
    pub max_twist: R,
    /// Kelvin–Voigt time (s), less what the step itself damps.
    pub damping: R,
    /// How joints resist twist.
    pub torsion: Torsion<R>,
    /// Whether this is the second Newton step, where frames differ from the start of the substep.
    pub second: bool,
    /// 1 in lanes that take this Newton step, 0 in lanes that are done. Where nothing touches, all do.
    pub again: R,
    /// 1 in lanes that take two Newton steps, else 0: others start from their inertial positions.
    pub twice: R,
}

/// State of an edge in the elimination pass.
#[derive(Clone, Copy)]
struct EdgeState<R> {
    q: Quaternion<R>,
    t: V3<R>,
    /// 1/|e|.
    r: R,
    /// Rotation since the start of the substep, twist included.
    turn: V3<R>,
    /// The same without twist: perpendicular to the edge.
    swing: V3<R>,
    /// Stiffness of its ends perpendicular to it, without the joint at its end.
    across: R,
    axial: R,
    /// Gradient of the energy with respect to its vector.
    pull: V3<R>,
    /// Coupling with the previous edge.
    coupling: Matrix<R>,
}

/// Fill-in that the elimination adds to the next nodes.
#[derive(Clone, Copy)]
struct FillIn<R> {
    /// Subtracted from the diagonal of the next node, and of the one after.
    next: Symmetric<R>,
    after: Symmetric<R>,
    /// Subtracted from the block between the two.
    between: Matrix<R>,
    b_next: V3<R>,
    b_after: V3<R>,
}

/// Position of a node at θ of the substep; held nodes are interpolated to their targets.
#[inline(always)]
fn place<W: Width>(w: W, node: &NodeLanes<W::Cell>, stage: &NewtonStage<W::Real>) -> V3<W::Real> {
    let (p, from) = (w.get3(&node.p), w.get3(&node.from));
    let between = (p - from).scale_add(stage.theta, from);
    V3::select(is_held(w, node), between, p)
}

/// `wanted` where `value`, the difference of places as large as `x`, is it but for their rounding.
#[inline(always)]
fn kept_within<W: Width>(w: W, value: W::Real, wanted: W::Real, x: V3<W::Real>) -> W::Real {
    let off = x.dot(x).sqrt() * w.lit(W::ROUNDING);
    wanted.min(value + off).max(value - off)
}

#[inline(always)]
fn is_held<W: Width>(w: W, node: &NodeLanes<W::Cell>) -> <W::Real as Real>::Mask {
    w.get(&node.w).lt(w.lit(1e-12))
}

/// Assembles and eliminates from the root to the tip, with frames transported to the present edges.
/// `TWICE`: some lanes take two Newton steps, which respect obstacles; the others are masked.
#[inline(always)]
pub(crate) fn down<W: Width, const TWICE: bool>(
    w: W,
    nodes: &[NodeLanes<W::Cell>],
    edges: &mut [EdgeLanes<W::Cell>],
    rows: &mut [DirectRow<W::Cell>],
    root: &[W::Cell; 4],
    stage: &NewtonStage<W::Real>,
) {
    let zero = w.lit(0.0);
    let none = w.zero3();
    let rate = w.lit(1.0) / stage.ahead;
    let inertia = rate * rate;
    let damped = stage.damping * rate;
    let stiffer = w.lit(1.0) + damped;
    let frame = w.get4(root);
    let mut before = EdgeState {
        q: frame,
        t: frame.tangent(),
        r: zero,
        turn: stage.root_turn,
        swing: stage.root_turn,
        across: zero,
        axial: zero,
        pull: none,
        coupling: Matrix::zero(zero),
    };
    let mut stiff_before = Symmetric::zero(zero);
    let mut pull_before = none;
    let mut left = FillIn {
        next: Symmetric::zero(zero),
        after: Symmetric::zero(zero),
        between: Matrix::zero(zero),
        b_next: none,
        b_after: none,
    };
    let mut x = place(w, &nodes[0], stage);
    let count = edges.len();
    for j in 0..=count {
        // The edge and the joint before it; past the tip there is neither.
        let mut now = EdgeState { r: zero, coupling: Matrix::zero(zero), ..before };
        let (mut couple, mut stiff) = (none, zero);
        if j < count {
            let edge = &mut edges[j];
            let to = place(w, &nodes[j + 1], stage);
            let e = to - x;
            x = to;
            let l = w.get(&edge.l);
            let axial = w.get(&edge.axial);
            let length = e.dot(e).max(w.lit(1e-30)).sqrt();
            let crushed = length.lt(l * w.lit(0.5));
            let q = w.get4(&edge.q);
            let (turned, turn) = parallel_transport(q, e, length);
            let stays = q;
            let q = choose(crushed, q, turned);
            let lever = length.max(l * w.lit(0.2));
            let r = w.lit(1.0) / lever;
            let t = V3::select(crushed, q.tangent(), e.scale(r));
            let turn = if TWICE && stage.second {
                turned_since(w, &nodes[j], &nodes[j + 1], t)
            } else {
                turn
            };
            // Twist is in equilibrium at all times, so it does not change at any joint: the
            // rotation of the edge before about this one's tangent is passed on.
            let swing = V3::select(crushed, none, turn);
            let turn = t.scale_add(before.turn.dot(t), swing);
            w.put4(if TWICE { choose(zero.lt(stage.again), q, stays) } else { q }, &mut edge.q);
            let taut = w.get(&edge.tension);
            // Positions are rounded, and edges so stiff that this rounding would pull like gravity: it would be taken
            // for what holds nodes where they rest.
            let stretch = W::Real::select(crushed, t.dot(e), length) - l;
            let wanted = taut / axial;
            let taken = if TWICE && stage.second {
                w.get(&edge.taken)
            } else {
                // Of what it has stretched, the limiter has left this. What presses is not kept: it would buckle the
                // strand once it has landed.
                let most = w.lit(MAX_TENSION.into());
                let left = wanted.min(l * w.lit(TOLERANCE.into()));
                wanted.min(l * most).max(left) - left
            };
            w.put(taken, &mut edge.taken);
            let kept = kept_within(w, stretch + taken, wanted, x);
            let (off, stretched) = (kept - stretch, axial * kept);
            if TWICE {
                let again = zero.lt(stage.again);
                w.put(W::Real::select(again, stretched, taut), &mut edge.tension);
            } else {
                w.put(stretched, &mut edge.tension);
            }
            let tension = stretched.max(taut).max(zero);
            let across = W::Real::select(crushed, axial, tension * r);
            let k = w.get(&edge.k);
            let torsion = stage.torsion.less(w.get(&edge.twist_loss));
            let elastic = moment(w, before.q, q, w.get4(&edge.rest), k, &torsion);
            // Where bends lie in many planes, twist relaxes somewhere along the strand, and
            // rotations passed on from the root overestimate those of edges. Friction must only
            // dissipate energy.
            let rate = turn - before.turn;
            let square = rate.dot(rate).max(w.lit(1e-30));
            let taken = rate.dot(swing - before.swing) / square;
            let friction = k * damped * taken.max(zero).min(w.lit(1.0));
            couple = rate.scale_add(friction, elastic);
            stiff = k * stiffer;
            let dot = t.dot(before.t);
            // Change of the twisting moment as edges rotate; without it twisted strands flutter. Of more
            // twist than a strand can hold the Hessian is indefinite: pivots vanish, and the fill-in
            // exceeds all numbers.
            let most = k * lever * stage.max_twist;
            let twist = elastic.dot(t).min(most).max(-most) * w.lit(-0.25) * r * before.r;
            let coupling = Matrix::coupling(before.t, t, dot, stiff * r * before.r);
            now = EdgeState {
                q,
                t,
                r,
                turn,
                swing,
                across: (stiff * r).mul_add(r, across),
                axial,
                pull: couple.cross(t).scale_add(r, t.scale_add(off - l, e).scale(axial)),
                coupling: coupling.plus_cross((t + before.t).scale(twist)),
            };
        }
        if j > 0 {
            let i = j - 1;
            // The previous edge is complete now.
            let across = (stiff * before.r).mul_add(before.r, before.across);
            let h = Symmetric::uniaxial(before.t, before.axial - across, across);
            let pull = couple.cross(before.t).scale_add(-before.r, before.pull);
            if i > 0 {
                // Node i, between edges i − 1 and i.
                left = eliminate::<W, TWICE>(
                    w,
                    &nodes[i],
                    &mut rows[i - 1],
                    stage,
                    inertia,
                    stiff_before.plus(h).minus_both(&before.coupling),
                    before.coupling.plus(now.coupling).minus_symmetric(&h),
                    &now.coupling,
                    pull - pull_before,
                    &left,
                );
            }
            (stiff_before, pull_before) = (h, pull);
        }
        before = now;
    }
    // The tip.
    let nothing = Matrix::zero(zero);
    eliminate::<W, TWICE>(
        w,
        &nodes[count],
        &mut rows[count - 1],
        stage,
        inertia,
        stiff_before,
        nothing,
        &nothing,
        -pull_before,
        &left,
    );
}

/// Eliminates node `node`: `diagonal` and `next` are its blocks, −`far` the one with the node after
/// the next, `force` the force of its edges.
#[inline(always)]
fn eliminate<W: Width, const TWICE: bool>(
    w: W,
    node: &NodeLanes<W::Cell>,
    row: &mut DirectRow<W::Cell>,
    stage: &NewtonStage<W::Real>,
    inertia: W::Real,
    diagonal: Symmetric<W::Real>,
    next: Matrix<W::Real>,
    far: &Matrix<W::Real>,
    force: V3<W::Real>,
    left: &FillIn<W::Real>,
) -> FillIn<W::Real> {
    let mass = w.get(&node.mass);
    let held = is_held(w, node);
    let inert = mass * inertia;
    let mut a = diagonal.plus(left.next).plus_diagonal(inert);
    let b = w.get3(&node.push).scale_add(mass, force + left.b_next);
    // Nodes start from where they would be without impulses.
    let mut kicked = w.get3(&node.kick).scale_add(inert * stage.ahead, b);
    if TWICE {
        let n = w.get3(&node.rests_on);
        let (sticks, drag) = (w.get(&node.sticks), w.get(&node.drag));
        let hold = inert * w.lit(HOLD);
        a = a.plus_outer(n, hold - hold * sticks).plus_diagonal(hold * sticks);
        let p = w.get3(&node.p);
        let inertial = w.get3(&node.v).scale_add(stage.ahead, w.get3(&node.from));
        // Friction: where the node sticks as stiff as the support, where it slides a force.
        let back = w.get3(&node.anchor) - p;
        let back = n.scale_add(-back.dot(n), back);
        let way = back.dot(back).max(w.lit(1e-24)).sqrt();
        let friction = back.scale(w.lit(HOLD).mul_add(sticks, drag / way));
        let pulled = (inertial - p + friction).scale_add(inert, b);
        kicked = V3::select(w.lit(0.0).lt(stage.twice), pulled, kicked);
    }
    let next = next.plus(left.between);
    let pivot = Pivot::new(&a, inert * w.lit(1e-3), held);
    let near_unscaled = pivot.unscaled(&next);
    let far_unscaled = pivot.unscaled(far);
    let near = pivot.scaled(&near_unscaled);
    let far = pivot.scaled(&far_unscaled);
    let y = pivot.forward(kicked);
    for (row, cells) in near.rows.into_iter().zip(&mut row.near) {
        w.put3(row, cells);
    }
    for (row, cells) in far.rows.into_iter().zip(&mut row.far) {
        w.put3(row, cells);
    }
    w.put3(pivot.divide(y), &mut row.solution);
    w.put3(V3::new(pivot.yx, pivot.zx, pivot.zy), &mut row.lower);
    let none = Symmetric::zero(w.lit(0.0));
    FillIn {
        next: left.after.minus_product(&near, &near_unscaled),
        after: none.minus_product(&far, &far_unscaled),
        // `far` is minus the block, so this adds.
        between: Matrix::zero(w.lit(0.0)).plus_product(&far, &near_unscaled),
        b_next: near.times_from(y, left.b_after),
        b_after: far.times_to(y, w.zero3()),
    }
}

/// Solves from the tip to the root and moves nodes, extrapolated from θ to the end of the substep.
#[inline(always)]
pub(crate) fn up<W: Width, const TWICE: bool>(
    w: W,
    nodes: &mut [NodeLanes<W::Cell>],
    edges: &mut [EdgeLanes<W::Cell>],
    rows: &[DirectRow<W::Cell>],
    stage: &NewtonStage<W::Real>,
) {
    let none = w.zero3();
    let (mut next, mut after) = (none, none);
    let mut ahead = none;
    for i in (0..=edges.len()).rev() {
        let node = &mut nodes[i];
        let mut y = place(w, node, stage);
        let (mut solved, mut moved) = (none, none);
        if i > 0 {
            let row = &rows[i - 1];
            let near =
                Matrix { rows: [w.get3(&row.near[0]), w.get3(&row.near[1]), w.get3(&row.near[2])] };
            let far =
                Matrix { rows: [w.get3(&row.far[0]), w.get3(&row.far[1]), w.get3(&row.far[2])] };
            let from = far.transposed_to(after, near.transposed_from(next, w.get3(&row.solution)));
            let l = w.get3(&row.lower);
            let y1 = (-l.z).mul_add(from.z, from.y);
            let x1 = (-l.y).mul_add(from.z, (-l.x).mul_add(y1, from.x));
            solved = V3::new(x1, y1, from.z);
            if TWICE {
                // Finished lanes and their tensions must not change.
                solved = V3::select(w.lit(0.0).lt(stage.again), solved, none);
                // Supports do not give way: what they are given to, so that there is a solution, tells their force.
                let (n, sticks) = (w.get3(&node.rests_on), w.get(&node.sticks));
                let back = w.get3(&node.anchor) - w.get3(&node.p);
                let back = n.scale_add(-back.dot(n), back);
                let (free, one) = (n.scale_add(-n.dot(solved), solved), w.lit(1.0));
                moved = free.scale(one - sticks) + back.scale(sticks);
                let way = back.dot(back).max(w.lit(1e-24)).sqrt();
                let slows = back.scale(w.get(&node.drag) / way);
                let holds = (moved - solved).scale_add(w.lit(HOLD), slows);
                let again = w.lit(0.0).lt(stage.again);
                moved = V3::select(again, moved, none);
                let holds = V3::select(again, holds, w.get3(&node.reaction));
                w.put3(holds, &mut node.reaction);
            } else {
                moved = solved;
            }
            y = y + moved;
        }
        let start = w.get3(&node.from);
        let to = (y - start).scale_add(stage.beyond, start);
        let to = if TWICE { V3::select(w.lit(0.0).lt(stage.again), to, y) } else { to };
        let to = V3::select(is_held(w, node), w.get3(&node.p), to);
        w.put3(to, &mut node.p);
        if i < edges.len() {
            let edge = &mut edges[i];
            let q = w.get4(&edge.q);
            let t = q.tangent();
            // Not from places, which are rounded. Where the lane is finished it is 0.
            let more = w.get(&edge.axial) * t.dot(ahead - moved);
            w.put(w.get(&edge.tension) + more, &mut edge.tension);
        }
        (after, next, ahead) = (next, solved, moved);
    }
}

/// Transports frames to the final nodes, computes velocities, and assembles the twist of all edges.
/// Returns zero where everything is finite.
#[inline(always)]
pub(crate) fn finish<W: Width>(
    w: W,
    nodes: &mut [NodeLanes<W::Cell>],
    edges: &mut [EdgeLanes<W::Cell>],
    rows: &mut [DirectRow<W::Cell>],
    root: &[W::Cell; 4],
    dt: f32,
    stage: &NewtonStage<W::Real>,
) -> W::Real {
    let (zero, one) = (w.lit(0.0), w.lit(1.0));
    let rate = w.lit(1.0 / f64::from(dt));
    let theta = stage.ahead * rate;
    let forth = rate * stage.beyond;
    let back = stage.beyond * (theta - one);
    let mut sum = zero;
    let mut x = w.zero3();
    // A row of the tridiagonal system for the rotations α about the tangents: of each joint K, its
    // moment along the tangents it joins, and −K t·t′ off the diagonal.
    let mut before =
        Twist { q: w.get4(root), t: w.zero3(), k: zero, clamp: zero, moment: zero, coupling: zero };
    before.t = before.q.tangent();
    let mut turns = Elimination::new(zero);
    for i in 0..nodes.len() {
        let node = &mut nodes[i];
        let to = w.get3(&node.p);
        let moved = to - w.get3(&node.from);
        let v = w.get3(&node.v).scale_add(back, moved.scale(forth));
        let v = V3::select(is_held(w, node), moved.scale(rate), v);
        w.put3(v, &mut node.v);
        sum = v.dot(v) + sum;
        let e = to - x;
        x = to;
        if i == 0 {
            continue;
        }
        let edge = &mut edges[i - 1];
        let length = e.dot(e).max(w.lit(1e-30)).sqrt();
        let crushed = length.lt(w.get(&edge.l) * w.lit(0.5));
        let kept = w.get4(&edge.q);
        let q = choose(crushed, kept, parallel_transport(kept, e, length).0);
        w.put4(q, &mut edge.q);
        // Of a strand of a thousand kilometres it may overflow where places do not.
        sum = q.dot(q) + sum + w.get(&edge.tension);
        let (t, k) = (q.tangent(), w.get(&edge.k));
        let rest = w.get4(&edge.rest);
        let torsion = stage.torsion.less(w.get(&edge.twist_loss));
        let elastic = moment(w, before.q, q, rest, k, &torsion);
        let (k, coupling) = if torsion.isotropic {
            (k, -(k * t.dot(before.t)))
        } else {
            let (diagonal, off) = twist_stiffness(before.q, q, rest, &torsion);
            (k * diagonal, k * off)
        };
        let clamp = w.get(&edge.clamped) * w.lit(CLAMP);
        let now = Twist { q, t, k, clamp, moment: elastic.dot(t), coupling };
        if i > 1 {
            before.moment = before.moment - elastic.dot(before.t);
            before.eliminate(k, &mut turns, rows, i - 2, w);
        }
        before = now;
    }
    before.eliminate(zero, &mut turns, rows, edges.len() - 1, w);
    sum * zero
}

/// Stiffness against rotation of an edge whose orientation is held (N m): joints have at most 1e6.
const CLAMP: f64 = 1e20;

/// State of an edge in the elimination of twist.
#[derive(Clone, Copy)]
struct Twist<R> {
    q: Quaternion<R>,
    t: V3<R>,
    /// Stiffness of the joint at its start against this edge's rotation.
    k: R,
    /// What holds it besides, if anything.
    clamp: R,
    /// Moment about its tangent.
    moment: R,
    /// Coupling with the previous edge.
    coupling: R,
}

impl<R: Real> Twist<R> {
    /// Eliminates the row of edge `i`, before a joint of stiffness `k_next`.
    #[inline(always)]
    fn eliminate<W: Width<Real = R>>(
        &self,
        k_next: R,
        turns: &mut Elimination<R>,
        rows: &mut [DirectRow<W::Cell>],
        i: usize,
        w: W,
    ) {
        let upper =
            turns.row(self.coupling, self.k + k_next + self.clamp, -self.moment, w.lit(1e-30));
        if i > 0 {
            w.put(upper, &mut rows[i - 1].twist_next);
        }
        w.put(turns.rhs, &mut rows[i].twist);
        w.put(w.lit(0.0), &mut rows[i].twist_next);
    }
}

/// Rotates edges about their tangents so that twist is in equilibrium.
#[inline(always)]
pub(crate) fn untwist<W: Width>(
    w: W,
    edges: &mut [EdgeLanes<W::Cell>],
    rows: &[DirectRow<W::Cell>],
) {
    let mut twist = w.lit(0.0);
    for (edge, row) in edges.iter_mut().zip(rows).rev() {
        twist = back(w.get(&row.twist), w.get(&row.twist_next), twist);
        twist = twist.max(w.lit(-1.5)).min(w.lit(1.5));
        // About the tangent, which in the edge's own frame is e3.
        let q = w.get4(&edge.q);
        let half = twist * w.lit(0.5);
        w.put4(q.add_scaled(turned_by_e3(q), half).normalize(), &mut edge.q);
    }
}
