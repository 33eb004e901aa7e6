#include "tests/engine/scene/whole_scene.h"

namespace viscera::test {

Json whole_scene() {
  return Json::parse(R"({
    "$schema": "scene.schema.json",
    "version": 1, "name": "whole", "title": "Every key", "duration_s": 4, "seed": 7,
    "organs": [
      {"name": "liver",
       "geometry": {"recipe": "liver", "seed": 3, "scale": 1.5, "edge_mm": 4},
       "tissue": "liver", "youngs_modulus_kPa": 6, "poisson_ratio": 0.4,
       "material": {"model": "neo_hookean", "relaxes": false, "prony": [{"g": 0.4, "tau_s": 2}]},
       "pose": {"position_mm": [10, 20, 30], "rotation_deg": [90, 0, 90]},
       "motion": {"amplitude_mm": 6, "direction": [0, -2, 0], "period_s": 5, "phase_deg": 90},
       "fixed": [{"half_space": {"point_mm": [0, 0, 5], "normal": [0, 0, 2]}},
                 {"sphere": {"centre_mm": [1, 2, 3], "radius_mm": 4}},
                 {"box": {"min_mm": [-1, -2, -3], "max_mm": [1, 2, 3]}}],
       "formulation": "galerkin",
       "resolution": {"spacing_mm": 10, "finest_spacing_mm": 2.5, "gradient": 0.3,
                      "fine": [{"half_space": {"point_mm": [0, 0, 1], "normal": [0, 0, 2]}},
                               {"sphere": {"centre_mm": [0, 0, 5], "radius_mm": 5}},
                               {"box": {"min_mm": [-1, -2, -3], "max_mm": [1, 2, 3]}}]},
       "displacement_storage": "half", "deformable": true, "sags": false,
       "response": "local", "stiffens": false, "spared": true,
       "finite": {"quasi_static": true, "viscous_time_ms": 5, "iterations": 3},
       "pulsation": {"strain": 0.05, "rate_per_min": 72}},
      {"name": "ball", "geometry": {"recipe": "sphere", "radius_mm": 25, "triangles": 500},
       "tissue": "rubber", "deformable": false,
       "parts": [{"capsule_mm": 0.5, "youngs_modulus_kPa": 100},
                 {"region": {"half_space": {"point_mm": [0, 0, 5], "normal": [0, 0, 2]}},
                  "youngs_modulus_kPa": 50, "density_kg_m3": 1100},
                 {"region": {"sphere": {"centre_mm": [1, 2, 3], "radius_mm": 4}},
                  "youngs_modulus_kPa": 50},
                 {"region": {"box": {"min_mm": [-1, -2, -3], "max_mm": [1, 2, 3]}},
                  "youngs_modulus_kPa": 50},
                 {"recipe": {"name": "kidney", "seed": 2}, "density_kg_m3": 1000},
                 {"labels": {"file": "map.nii", "label": 3}, "youngs_modulus_kPa": 40},
                 {"field": {"file": "map.nii", "kPa_per_unit": 0.001}}]},
      {"name": "brick", "geometry": {"recipe": "block", "size_mm": [10, 20, 30]},
       "tissue": "rubber", "deformable": false},
      {"name": "imported", "tissue": "kidney", "deformable": false,
       "geometry": {"file": "ball.obj", "unit": "cm", "recentre": true, "edge_mm": 2,
                    "wrap": {"voxel_mm": 1.5, "close_mm": 4}}}],
    "links": [
      {"name": "bed", "between": ["liver", "ball"], "stiffness_N_per_m": 200,
       "region": {"sphere": {"centre_mm": [1, 2, 3], "radius_mm": 4}}},
      {"name": "ligament", "between": ["ground", "liver"], "stiffness_N_per_m": 0,
       "region": {"box": {"min_mm": [-1, -2, -3], "max_mm": [1, 2, 3]}}}],
    "instruments": [
      {"name": "holder", "kind": "grasper",
       "tip": {"shape": "capsule", "radius_mm": 2, "length_mm": 12}, "trocar_mm": [0, 0, 200], "shaft_radius_mm": 3, "roll_deg": 90, "grip_limit_N": 5, "grip_radius_mm": 3, "friction": 0.4,
       "path": [{"time_s": 0, "tip_mm": [0, 0, 100], "jaw": 1, "power_W": 0},
                {"time_s": 1.5, "tip_mm": [0, 0, 90], "jaw": 0}],
       "haptic": {"device": "recorded", "recording": "hand.csv", "coupling_N_per_m": 900,
                  "hive": {"radius_mm": 12, "nodes": 90, "periphery": "boussinesq", "formulation": "paper"}}},
      {"name": "burner", "kind": "hook", "mode": "coagulate", "tip": {"shape": "mesh", "file": "ball.obj", "unit": "m"},
       "trocar_mm": [50, 0, 200], "path": [{"time_s": 0, "tip_mm": [0, 0, 100], "power_W": 30}],
       "haptic": {"grip": "firm"}},
      {"name": "far", "kind": "probe", "trocar_mm": [50, 0, 200],
       "path": [{"time_s": 0, "tip_mm": [0, 0, 100]}],
       "haptic": {"device": "network", "port": 18945}}],
    "camera": {"optics_deg": 30, "field_of_view_deg": 60, "round_mask": false,
               "path": [{"time_s": 0, "tip_mm": [0, -100, 50], "target_mm": [0, 0, 0],
                         "roll_deg": 180}]},
    "light": {"intensity": 2, "colour_temperature_K": 5000},
    "smoke": [{"name": "plume", "domain": {"min_mm": [0, 0, 0], "max_mm": [100, 100, 100]},
               "voxel_mm": 1, "max_particles": 1000, "particle_mass_ug": 0.2, "spacing_mm": 2,
               "laplacian": "paper", "lifetime_s": 5, "look": "sprites",
               "emitters": [{"instrument": "burner"},
                            {"position_mm": [50, 50, 10], "direction": [0, 0, 2], "radius_mm": 2,
                             "rate_mg_per_s": 3, "particles_per_s": 500, "speed_mm_per_s": 200,
                             "excess_K": 40, "from_s": 1, "to_s": 2}]}],
    "gas": {"pressure_mmHg": 15, "temperature_C": 20, "cells": 24, "cavity_L": 4,
            "humidity": 0.5, "compliance_mL_per_mmHg": 90,
            "domain": {"min_mm": [0, 0, 0], "max_mm": [120, 110, 100]},
            "inlets": [{"position_mm": [10, 10, 99], "direction": [0, 0, -3], "radius_mm": 4,
                        "limit_L_per_min": 6, "from_s": 0, "to_s": 3}],
            "leaks": [{"position_mm": [90, 10, 100], "area_mm2": 2}],
            "evacuators": [{"instrument": "holder", "radius_mm": 6, "flow_L_per_min": 12,
                            "from_s": 1, "to_s": 2},
                           {"position_mm": [100, 10, 90], "flow_L_per_min": 30}]},
    "heat": {"voxel_mm": 0.25, "lesion_of": "burner",
             "published": {"least_depth_mm": 1, "most_depth_mm": 2, "least_width_mm": 3,
                           "most_width_mm": 4, "source": "recalled"}},
    "gravity": {"acceleration_m_per_s2": 1.62, "rest_direction": [2, 0, 0],
                "table": [{"time_s": 0, "head_up_deg": 0, "left_side_down_deg": -10},
                          {"time_s": 3, "head_up_deg": 20, "left_side_down_deg": 15}]}
  })");
}

Json least_scene() {
  return Json::parse(R"({"version": 1, "name": "least", "organs": [
    {"name": "ball", "geometry": {"recipe": "sphere", "radius_mm": 25}, "tissue": "rubber",
     "fixed": [{"half_space": {"point_mm": [0, 0, -20], "normal": [0, 0, 1]}}]}]})");
}

}  // namespace viscera::test
