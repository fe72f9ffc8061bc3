// SPDX-License-Identifier: MIT
#pragma once

/// palpate: soft tissue and haptics. This header reads as the table of contents; each line can be included alone.
/// Headers of their own, because few programs need them and each costs compile time: palpate/organs.hpp (demo organs),
/// palpate/tool.hpp (tools longer than a point), palpate/fitting.hpp (coefficients from measurements), palpate/training.hpp
/// (sessions of a person, guidance), and the drivers palpate/device/phantom.hpp and palpate/device/force_dimension.hpp. For policies of one's own palpate/extend/ has a
/// header for each family: law, material, integrator, tissue, cutter, device, force.

// core: scalars, errors, random numbers, units, frames
#include <palpate/core/error.hpp>
#include <palpate/core/event_ring.hpp>
#include <palpate/core/execution.hpp>
#include <palpate/core/flush_denormals.hpp>
#include <palpate/core/instruction_set.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/phase.hpp>
#include <palpate/core/policy.hpp>
#include <palpate/core/random.hpp>
#include <palpate/core/rotation_vector.hpp>
#include <palpate/core/serial.hpp>
#include <palpate/core/similarity.hpp>
#include <palpate/core/tool_pose.hpp>
#include <palpate/core/triple_buffer.hpp>
#include <palpate/core/units.hpp>
#include <palpate/core/version.hpp>

// mesh: surfaces and volumes, their measures, and meshes to start from
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/edges.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/quality.hpp>
#include <palpate/mesh/repair.hpp>
#include <palpate/mesh/rings.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/mesh/surface_topology.hpp>
#include <palpate/mesh/tetrahedral_adjacency.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/tetrahedral_topology.hpp>
#include <palpate/mesh/topology_edit.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/mesh/validation.hpp>
#include <palpate/mesh/tetrahedra_where.hpp>
#include <palpate/mesh/vertices_where.hpp>
#include <palpate/mesh/wound_walls.hpp>

// collision: where the tool is nearest
#include <palpate/collision/closest_point.hpp>
#include <palpate/collision/surface_tree.hpp>
#include <palpate/collision/tool_shape.hpp>

// material: what stress a deformation costs
#include <palpate/material/concept.hpp>
#include <palpate/material/corotational.hpp>
#include <palpate/material/isotropic.hpp>
#include <palpate/material/linear_elastic.hpp>
#include <palpate/material/neo_hookean.hpp>
#include <palpate/material/presets.hpp>
#include <palpate/material/principal_tangent.hpp>
#include <palpate/material/st_venant_kirchhoff.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/material/viscoelastic.hpp>

// tissue: what the body is made of
#include <palpate/tissue/concept.hpp>
#include <palpate/tissue/cubic_spring.hpp>
#include <palpate/tissue/element.hpp>
#include <palpate/tissue/element_tissue.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/linear_spring.hpp>
#include <palpate/tissue/linear_tetrahedron.hpp>
#include <palpate/tissue/locking_spring.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/maximum_elongation.hpp>
#include <palpate/tissue/saturating_spring.hpp>
#include <palpate/tissue/spring_elements.hpp>
#include <palpate/tissue/spring_law.hpp>
#include <palpate/tissue/supported.hpp>

// integrator: how it moves
#include <palpate/integrator/concept.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/crank_nicolson.hpp>
#include <palpate/integrator/dormand_prince.hpp>
#include <palpate/integrator/explicit_euler.hpp>
#include <palpate/integrator/explicit_midpoint.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/measured_stability.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/integrator/stoermer_verlet.hpp>
#include <palpate/integrator/symplectic_euler.hpp>
#include <palpate/integrator/theta_scheme.hpp>
#include <palpate/integrator/velocity_verlet.hpp>

// region: which particles are computed
#include <palpate/region/concept.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>

// statics: where a body comes to rest
#include <palpate/statics/concept.hpp>
#include <palpate/statics/dynamic_relaxation.hpp>
#include <palpate/statics/linear_solver.hpp>
#include <palpate/statics/local_relaxation.hpp>
#include <palpate/statics/newton_raphson.hpp>

// body: tissue, integrator and region, with state; where a tool touches it
#include <palpate/body/concept.hpp>
#include <palpate/body/damping.hpp>
#include <palpate/body/modal_view.hpp>
#include <palpate/body/pieces.hpp>
#include <palpate/body/soft_body.hpp>
#include <palpate/body/surface_changes.hpp>
#include <palpate/body/temporary_subdivision.hpp>
#include <palpate/body/touch.hpp>

// cutting: how topology changes
#include <palpate/cutting/aspirator.hpp>
#include <palpate/cutting/blade_edge.hpp>
#include <palpate/cutting/concept.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/cutting/separating_cutter.hpp>
#include <palpate/cutting/volume_cutter.hpp>

// force: what the hand feels
#include <palpate/force/band_limited_noise.hpp>
#include <palpate/force/blade.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/force/curve.hpp>
#include <palpate/force/curve_join.hpp>
#include <palpate/force/curve_report.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/exponential_contact.hpp>
#include <palpate/force/hunt_crossley_contact.hpp>
#include <palpate/force/indentation_spring.hpp>
#include <palpate/force/karnopp_friction.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/needle_force.hpp>
#include <palpate/force/network.hpp>
#include <palpate/force/network_training.hpp>
#include <palpate/force/noise.hpp>
#include <palpate/force/organ_force.hpp>
#include <palpate/force/polynomial_contact.hpp>
#include <palpate/force/speed_curve.hpp>
#include <palpate/force/tissue_presets.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/force/trainer.hpp>

// device: where the hand is
#include <palpate/device/any_device.hpp>
#include <palpate/device/built_in_devices.hpp>
#include <palpate/device/capabilities.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/device/device_address.hpp>
#include <palpate/device/device_registry.hpp>
#include <palpate/device/faulty_device.hpp>
#include <palpate/device/hand_sample.hpp>
#include <palpate/device/hand_tremor.hpp>
#include <palpate/device/lifecycle.hpp>
#include <palpate/device/limit.hpp>
#include <palpate/device/mouse_device.hpp>
#include <palpate/device/null_device.hpp>
#include <palpate/device/recorded_device.hpp>
#include <palpate/device/replay_device.hpp>
#include <palpate/device/sampled_mass.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/device/session.hpp>
#include <palpate/device/simulated_hand.hpp>
#include <palpate/device/simulated_touch.hpp>
#include <palpate/device/trajectory.hpp>

// haptics: how the tip and the tissue push each other
#include <palpate/haptics/concept.hpp>
#include <palpate/haptics/contact_coupling.hpp>
#include <palpate/haptics/coupled_force.hpp>
#include <palpate/haptics/facet_planes.hpp>
#include <palpate/haptics/filtered_wall.hpp>
#include <palpate/haptics/force_limits.hpp>
#include <palpate/haptics/local_model.hpp>
#include <palpate/haptics/overlay.hpp>
#include <palpate/haptics/passivity.hpp>
#include <palpate/haptics/patch_handover.hpp>
#include <palpate/haptics/plane_handover.hpp>
#include <palpate/haptics/plane_set.hpp>
#include <palpate/haptics/press_then_cut.hpp>
#include <palpate/haptics/proxy_force.hpp>
#include <palpate/haptics/safety_chain.hpp>
#include <palpate/haptics/safety_event.hpp>
#include <palpate/haptics/safety_options.hpp>
#include <palpate/haptics/sampled_wall.hpp>
#include <palpate/haptics/shaded_normal.hpp>
#include <palpate/haptics/spring_then_tissue.hpp>
#include <palpate/haptics/surface_fit.hpp>
#include <palpate/haptics/surface_patch.hpp>
#include <palpate/haptics/surface_proxy.hpp>
#include <palpate/haptics/surface_sensor.hpp>
#include <palpate/haptics/velocity_estimate.hpp>
#include <palpate/haptics/virtual_coupling.hpp>
#include <palpate/haptics/workspace_mapping.hpp>

// simulator: everything together, in lock-step or in real time
#include <palpate/simulator/budget.hpp>
#include <palpate/simulator/pacer.hpp>
#include <palpate/simulator/realtime_options.hpp>
#include <palpate/simulator/realtime_thread.hpp>
#include <palpate/simulator/recording.hpp>
#include <palpate/simulator/seqlock.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/simulator/simulator_statistics.hpp>
#include <palpate/simulator/snapshot.hpp>
#include <palpate/simulator/tick.hpp>
#include <palpate/simulator/tick_statistics.hpp>
