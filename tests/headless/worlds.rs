//! Worlds that move: each figure that `headless --scene worlds` prints is within its tolerance.

use crate::{check, worlds_measured as measured};

#[test]
fn uneven_frames_do_not_move_hair() {
    check(measured::frames(&measured::RIDES[1..3], 2.0));
}

#[test]
fn any_rate_of_ticks_costs_what_it_needs() {
    check(measured::rates());
}

#[test]
fn riders_lean_the_same_at_any_rate_of_ticks() {
    check(measured::riders());
}

#[test]
fn hair_that_was_away_comes_back_at_rest() {
    check(measured::returns());
}

#[test]
fn a_runner_is_put_elsewhere_and_its_hair_goes_on() {
    check(measured::portals());
}

#[test]
fn a_portal_in_the_frame_of_a_hitch_is_no_worse() {
    check(measured::hitches());
}

#[test]
fn a_shift_of_the_world_moves_nothing_in_it() {
    check(measured::shifts());
}

#[test]
fn a_rider_gets_on_a_vehicle_and_off_it() {
    check(measured::reparented());
}

#[test]
fn water_on_hair_goes_along() {
    check(measured::wet_jumps());
}

#[test]
fn the_air_of_a_vehicle_moves_with_it() {
    check(measured::vehicles());
}

#[test]
fn wind_and_headwind_are_in_the_same_units_at_any_scale() {
    check(measured::scales());
}

#[test]
fn a_squashed_head_is_drawn_as_it_is_simulated() {
    check(measured::squashed());
}

#[test]
fn hair_of_a_hidden_head_waits() {
    check(measured::hidden());
}

#[test]
fn gusts_of_a_long_game_are_those_of_a_young_one() {
    check(measured::gusts());
}

#[test]
fn solids_winds_and_water_are_as_large_as_they_are_drawn() {
    check(measured::solids());
}

#[test]
fn rain_wets_as_much_far_from_the_origin() {
    check(measured::far_rain());
}

#[cfg(all(feature = "groom", feature = "save"))]
#[test]
fn roots_that_are_touched_again_move_nothing() {
    check(measured::roots());
}

#[cfg(all(feature = "groom", feature = "save"))]
#[test]
fn a_copy_of_a_character_has_one_hair_on_its_own_head() {
    check(measured::copies());
}

#[cfg(all(feature = "groom", feature = "save"))]
#[test]
fn characters_and_gusts_are_as_they_were_saved_as_text() {
    check(measured::scenes());
}

#[cfg(all(feature = "groom", feature = "save"))]
#[test]
fn hair_follows_meshes_that_change() {
    check(measured::edits());
}
