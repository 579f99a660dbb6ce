//! Constants that kernels share with the code that they follow, written out in WGSL under the same names.

use super::{
    followers::OFFSET_VECTORS,
    layout::{GROUP_SIZE, SCRATCH},
    record::*,
    sweeps::{PRINTED, SPLIT},
};
use crate::{
    forces::environment::wind::REFERENCE_DISTANCE,
    keratin::bond::model::MIN_CLOSED_SHARE,
    render::{FAR, MOTION_UNITS},
    simulation::{
        lod::follow::{GUIDES, OWN_LASTS},
        solve::{MOST_STRAIN, MOST_SWEPT_STRAIN},
    },
    solver::rod::{
        constraint::EPSILON,
        direct::{width::ROUNDING, *},
        limiter::{FIRMNESS, FOLDING, HOLD, MAX_TENSION, TOLERANCE},
        near::{ESCAPE_RATIO, FASTER},
        step::PASSES_IN_TOUCH,
        stiffness::REFERENCE_GRAVITY,
        touch::{DEPTH_RATIO, FrictionPass, REVERSING, TOUCHING},
    },
};
use std::sync::LazyLock;

const FRICTION_PASS_NONE: u32 = FrictionPass::None as u32;
const FRICTION_PASS_DEPTH: u32 = FrictionPass::Depth as u32;
const FRICTION_PASS_BETWEEN: u32 = FrictionPass::Between as u32;
const FRICTION_PASS_ASSUMED: u32 = FrictionPass::Assumed as u32;
const FRICTION_PASS_JUDGED: u32 = FrictionPass::Judged as u32;
const FRICTION_PASS_SOLVED: u32 = FrictionPass::Solved as u32;

macro_rules! wgsl {
    ($($type:ident { $($name:ident)* })*) => {
        [$($(format!("const {}: {} = {:?};\n", stringify!($name), stringify!($type), $name as $type)),*),*]
    };
}

static CONSTANTS: LazyLock<String> = LazyLock::new(|| {
    let all = wgsl! {
        u32 {
            GROUP_SIZE SCRATCH MAX_OBSTACLES MAX_BLOWERS MOST_TREATMENTS
            FRAME_MOVES SHAPES REMEMBERS NOTES_BEFORE RESTS ROOT_TARGETS HOLDS FOLLOWS WAKES SWEEPS
            HALF_SPACE CAPSULE CYLINDER ELLIPSOID
            SLEPT ROOT FREE GUIDES OFFSET_VECTORS SPLIT PRINTED
            PASSES_IN_TOUCH MAX_REPAIRS LEAVING MOST_STEPS
            FRICTION_PASS_NONE FRICTION_PASS_DEPTH FRICTION_PASS_BETWEEN
            FRICTION_PASS_ASSUMED FRICTION_PASS_JUDGED FRICTION_PASS_SOLVED
        }
        f32 {
            THETA MAX_PUSH FAST_TURN STRAIN STRETCH_RATIO STRETCH_SHARE MAX_TENSION TORN MAX_STRAIN NEARER DEEP_SHARE MAX_BENDING_LENGTH MAX_STIFFNESS BUCKLING_TWIST HOLD ROUNDING
            REFERENCE_GRAVITY FIRMNESS TOUCHING REVERSING FOLDING TOLERANCE EPSILON FASTER ESCAPE_RATIO DEPTH_RATIO MIN_CLOSED_SHARE REFERENCE_DISTANCE
            OWN_LASTS FAR MOTION_UNITS MOST_STRAIN MOST_SWEPT_STRAIN
        }
    };
    all.concat()
});

/// The source of kernels, after the constants that they use.
pub(super) fn source(kernels: &str) -> String {
    CONSTANTS.clone() + kernels
}

#[cfg(test)]
mod tests {
    use super::{super::pipelines::KERNELS, *};

    #[test]
    fn no_kernel_has_a_constant_of_its_own_that_the_code_has_too() {
        for (name, text, _) in KERNELS {
            let own = text.lines().filter_map(|line| line.strip_prefix("const "));
            for own in own.map(|line| line.split([':', ' ']).next().unwrap_or_default()) {
                assert!(own.starts_with("NO_"), "{own} of {name} is not in constants.rs");
            }
        }
        let bits = |name: &str| CONSTANTS.contains(name);
        assert!(bits("const HOLD: f32 = 100000.0;\n") && bits("const WAKES: u32 = 256;\n"));
    }
}
