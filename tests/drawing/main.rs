//! Apps that draw, on any Vulkan device.

#[path = "../common/plugins.rs"]
mod all_plugins;
#[path = "../common/mod.rs"]
mod common;
#[path = "../common/device.rs"]
mod device;
#[path = "../common/example.rs"]
mod example;
#[path = "../common/linear.rs"]
mod linear;
#[path = "../../examples/shared/mannequin.rs"]
#[allow(dead_code, reason = "each program uses its part")]
mod mannequin;
#[path = "../common/offscreen.rs"]
mod offscreen;

/// What the modules of examples expect of their app.
mod scenes {
    pub const HEAD_RADIUS: f32 = 0.1;
}

mod commands;
mod cost;
mod coverage;
mod cut;
mod dye;
mod fibre;
mod frames;
mod games;
mod groom;
mod light;
mod look;
mod pictures;
mod plugins;
mod reference;
mod twin;
mod wet;

device::tests! {
    commands {
        device: a_tail_in_the_wrong_unit_is_shown_in_the_right_one_and_without_a_head;
    }
    cost {
        device: a_hair_is_one_draw_call_in_every_view_and_one_of_depth_before_it_in_pictures,
            a_hundred_heads_share_a_mesh_of_few_strands;
        on_request: frames_a_second,
            what_each_stage_costs;
    }
    coverage {
        device: strands_cover_as_much_from_near_and_far_and_at_their_tips,
            smoothing_changes_hair_alone_and_leaves_no_mark,
            nothing_pops_as_a_camera_flies_away;
        // A million pixels of hair in software.
        on_request: edges_are_those_of_a_picture_with_sixteen_times_the_pixels;
    }
    cut {
        device: a_blunt_cut_ends_all_drawn_strands_and_leaves_the_rest_of_the_picture,
            a_cut_to_a_length_ends_followers_with_roots_of_their_own;
    }
    dye {
        device: black_hair_is_drawn_pink_and_roots_and_tips_apart,
            streaks_are_the_share_of_strands_that_was_asked_for;
    }
    fibre {
        anywhere: a_wet_lock_is_darker_than_dry_hair_wherever_light_comes_from,
            what_flows_through_layers_begins_as_all_and_ends_as_what_comes_through,
            a_fibre_conserves_energy_and_pigment_only_absorbs,
            shares_of_one_fibre_are_those_of_its_lobes,
            light_that_went_through_others_is_spread_not_added,
            among_fibres_that_point_elsewhere_light_leaves_its_cone,
            infinitely_deep_hair_has_the_colour_of_its_melanin,
            layers_without_pigment_return_what_diffusion_returns,
            highlights_on_a_cylinder_lie_where_path_tracing_has_them,
            the_clear_highlight_leans_to_the_root_and_the_coloured_one_to_the_tip,
            all_results_are_finite_for_any_fibre_and_light;
    }
    frames {
        device: hair_is_where_the_guides_are_and_shows_their_rates,
            rings_of_a_frame_draw_what_each_vertex_would_compute,
            followers_cover_more_frames_repeat_and_wet_is_darker,
            the_highlight_lies_across_and_moves_with_the_light,
            hair_receives_and_casts_shadow,
            bad_hair_neither_panics_nor_leaves_a_stale_picture,
            every_kind_of_light_lights_hair_through_every_kind_of_camera,
            prepasses_leave_no_holes_and_motion_moves_nothing,
            followers_are_laid_out_again_when_roots_are_edited_and_rest,
            wet_locks_are_tighter,
            coincident_guides_and_nodes_are_drawn,
            water_is_drawn_as_beads_as_long_as_there_is_any,
            soaked_hair_is_darker_and_droplets_are_seen,
            views_do_not_disturb_each_other_nor_does_a_minimised_window;
        alone: hair_and_water_outlive_a_lost_device;
    }
    games {
        device: layers_of_a_hair_and_of_its_wearer_hide_it_and_its_shadow,
            drops_are_seen_where_their_hair_is_or_where_they_say,
            an_irradiance_volume_lights_hair_as_a_sky_does,
            lights_of_another_layer_leave_hair_as_it_was,
            foliage_is_as_without_the_plugin_and_beside_hair,
            hair_behind_a_pane_is_hair_and_pane,
            a_second_camera_leaves_the_first_ones_picture,
            a_camera_laid_over_leaves_what_is_below,
            a_transparent_picture_has_the_coverage_of_its_hair,
            a_close_up_far_from_the_origin_is_as_at_it,
            what_lights_hair_compiles_for_cameras_in_air;
    }
    groom {
        device: followers_are_drawn_where_they_are_given_and_no_more_than_asked_for,
            hair_that_is_played_is_drawn_as_it_was_when_it_was_recorded;
    }
    light {
        device: what_comes_through_strands_falls_with_their_number,
            light_falls_off_bit_by_bit_on_its_way_into_hair,
            a_light_without_a_shadow_map_falls_off_as_well,
            hair_under_a_sky_has_its_melanins_colour,
            hair_does_not_flicker_as_the_camera_creeps,
            a_hollow_is_darker_under_a_sky_than_what_stands_out;
    }
    look {
        device: white_hair_vanishes_in_a_white_sky,
            light_from_the_other_side_makes_the_mirror_image,
            no_look_however_absurd_leaves_a_pixel_without_a_number;
    }
    pictures {
        on_request: studio_pictures,
            portraits;
    }
    plugins {
        device: each_part_switches_off_alone,
            all_parts_switch_off_together,
            hair_is_drawn_without_any_one_of_them,
            hair_is_drawn_without_all_of_them;
        anywhere: any_plugin_may_be_left_out_and_what_misses_it_says_so_once,
            any_set_of_plugins_may_be_left_out,
            nothing_falls_without_the_environment_and_nothing_hides_without_settling;
    }
    reference {
        device: a_tress_has_the_colour_that_path_tracing_gives_it,
            a_tress_lit_from_above_and_behind_is_near_path_tracing,
            a_ball_glows_at_its_rim_as_path_tracing_has_it,
            a_ball_in_a_furnace_returns_what_path_tracing_returns;
    }
    twin {
        device: the_shader_puts_strands_where_its_rust_twin_does,
            the_shader_lights_fibres_as_its_rust_twin_does;
    }
    wet {
        device: wet_hair_is_darker_deeper_in_colour_and_sleeker;
    }
}
