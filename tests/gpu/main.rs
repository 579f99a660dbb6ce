//! Hair by compute shaders.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/device.rs"]
mod device;
#[path = "../common/example.rs"]
mod example;
mod lab;
#[path = "../common/offscreen.rs"]
mod offscreen;
#[path = "../../examples/shared/scenes/mod.rs"]
mod scenes;
mod twin;
#[path = "../common/golden.rs"]
mod vectors;

mod bad;
mod bits;
mod closed_forms;
mod commands;
mod cost;
mod golden;
mod handover;
mod journal;
mod layout;
mod lod;
mod pairs;
mod papers;
mod pictures;
mod pipelined;
mod present;
mod probe;
mod residence;
mod shapes;
mod sleep;
mod stage;
mod substep;
mod sweeps;
mod targets;

device::tests! {
    bits {
        device: hand_over_and_return_without_a_substep_change_no_bit,
            ten_runs_are_equal_to_the_bit_whatever_stands_beside_and_however_they_are_submitted,
            nan_stays_with_its_strand_and_is_counted_once,
            obstacles_out_of_reach_change_no_bit_however_many,
            records_of_nan_leave_strands_whole,
            a_shaken_strand_of_64_segments_holds_its_length;
    }
    closed_forms {
        device: sets_keep_the_share_of_the_bonds_that_formed,
            a_perm_keeps_two_thirds_and_survives_washing_in_part,
            a_treatment_takes_rates_the_asked_share_of_the_way_and_never_cuts_the_backbone;
    }
    commands {
        device: a_scene_runs_on_a_graphics_device_and_says_so;
    }
    cost {
        alone: a_hundred_thousand_strands_cost_less_than_a_look_at_them;
    }
    golden {
        device: a_substep_of_the_direct_solver;
    }
    journal {
        device: a_journal_holds_all_that_the_tick_does_to_hair_that_moves;
        anywhere: what_the_kernels_lack_keeps_hair_on_the_processor_and_is_reported;
    }
    layout {
        anywhere: slots_never_overlap_and_lie_within,
            what_is_put_is_what_is_got,
            a_record_is_as_long_whatever_it_holds;
    }
    pictures {
        alone: hair_goes_on_from_its_checkpoint_when_the_device_is_lost;
        device: pictures_of_hair_on_the_device_and_at_home_are_the_same,
            kernels_that_cannot_be_compiled_leave_hair_at_home;
    }
    pipelined {
        device: hair_on_the_device_has_the_same_bits_with_pipelined_rendering,
            hair_is_drawn_alike_with_pipelined_rendering;
    }
    present {
        device: drawn_nodes_are_those_of_the_strands_between_the_last_two_ticks;
    }
    residence {
        device: hair_goes_to_the_device_and_comes_home;
    }
    substep {
        device: free_strands,
            strands_in_a_frame_that_moves,
            strands_among_obstacles,
            strands_whose_roots_lie_in_an_obstacle,
            strands_in_wind_that_dries,
            strands_by_the_papers_projections,
            strands_among_obstacles_by_the_papers_projections;
    }
    sweeps {
        device: golden_vectors_of_the_papers_projections,
            swept_strands_keep_their_bits,
            nan_stays_with_its_swept_strand,
            closed_forms_by_the_papers_projections;
    }
}
