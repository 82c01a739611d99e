"""Tests that `make validate` runs and `make test` does not, besides those with the mark.

Each is one of several that look at the same thing, or slow physics that quicker tests beside it
guard. Named as pytest does, up to the parameters or within them; tests/conftest.py marks them, and
fails where one of them is no longer there.
"""

SLOW = (
    # Curved bodies in space: the plane ones, and the kits of shapes and discretisations, stay.
    "tests/plugins/discretisations/test_discretisations.py::"
    "test_particles_that_own_the_surface_stand_on_it[Ball-Fitted]",
    "tests/plugins/discretisations/test_discretisations.py::"
    "test_particles_that_own_the_surface_stand_on_it[Cylinder-Fitted]",
    "tests/plugins/discretisations/test_discretisations.py::"
    "test_surface_particles_lie_on_the_surface_and_none_beside_another[0.053-",
    "tests/plugins/boundaries/test_boundaries.py::"
    "test_total_load_on_curved_faces_and_around_corners[shape3-",
    "tests/plugins/boundaries/test_boundaries.py::"
    "test_total_load_on_curved_faces_and_around_corners[shape2-",
    "tests/probes/test_probes.py::test_a_curved_face_is_where_it_is[3]",
    "tests/plugins/shapes/test_mesh_bodies.py::test_a_uniform_stretch_is_reproduced[torus]",
    # Larger systems of equations.
    "tests/statics/test_iterative.py::test_a_bent_beam[0.0-3]",
    "tests/statics/test_iterative.py::test_a_bent_beam[0.49-3]",
    "tests/statics/test_iterative.py::test_a_finer_body_takes_hardly_more_iterations",
    "tests/statics/test_iterative.py::test_a_block_of_disordered_particles",
    "tests/plugins/gradients/test_consistent.py::"
    "test_by_iteration_the_sums_are_those_by_factorisation[2-cubic]",
    # Cases, whose figures and bars are validated.
    "tests/cases/test_sheet_convergence.py::test_errors_fall_faster_than_the_spacing",
    "tests/cases/test_sheet_convergence.py::test_other_sheets_have_no_reference_but_a_picture",
    "tests/cases/test_interpolation.py::"
    "test_pictures_and_tables_are_there_by_the_names_of_their_figures[case1]",
    "tests/cases/test_interpolation.py::"
    "test_pictures_and_tables_are_there_by_the_names_of_their_figures[case2]",
    "tests/cases/test_nonlinear_bar.py::test_a_hundred_particles_keep_within_every_bar",
    "tests/cases/test_benchmark_cases.py::test_cantilever_plate_in_two_independent_ways",
    "tests/cases/test_benchmark_cases.py::test_sheet_with_hole_at_twenty_particles_a_quarter",
    "tests/cases/test_boundary_values.py::test_a_run_draws_the_figure_and_writes_its_data",
    # Every combination, beside those that are certified one by one.
    "tests/studies/test_certificate.py::test_every_combination_has_a_certificate_or_is_refused",
    # A full disk late in a run, beside one early in it.
    "tests/results/test_resume.py::test_what_a_full_disk_stops_goes_on[900000-",
    # What takes long to compile, beside what does not: other laws, the same in fewer dimensions.
    "tests/engines/test_merged_loads.py::test_beside_a_material_that_remembers",
    "tests/engines/test_merged_loads.py::test_one_is_merged_and_the_other_has_a_pass_of_its_own",
    "tests/engines/test_time_loop.py::test_every_effect[joint]",
    "tests/engines/test_engines.py::test_compiled_agrees_for_every_material[2-holzapfel-ogden]",
    "tests/engines/test_whole_steps.py::test_all_that_ask_get_one_answer[a law that remembers]",
    "tests/engines/test_time_loop.py::test_every_effect[hourglass-control]",
    "tests/engines/test_block_law.py::"
    "test_lanes_know_all_that_built_in_laws_are_made_of[holzapfel-ogden]",
    "tests/engines/test_block_law.py::"
    "test_lanes_know_all_that_built_in_laws_are_made_of[j2-plasticity]",
    "tests/engines/test_block_law.py::"
    "test_lanes_know_all_that_built_in_laws_are_made_of[johnson-cook]",
    "tests/plugins/materials/test_history.py::test_every_engine_remembers_the_same[2-johnson-cook]",
    "tests/plugins/effects/test_contact.py::test_momenta_stay_and_the_ledger_closes[0.0-3]",
    "tests/statics/test_lowest_modes.py::"
    "test_frequencies_by_iteration_are_those_of_a_factorisation[0.3-3]",
)
