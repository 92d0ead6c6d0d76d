/// \file
/// The fields that a plug-in writes, once: their names, where they are on either side, and their order in an answer.
#pragma once

#include "oracle/plugin.h"
#include "reference/state.hpp"

#include <cstddef>

namespace decant::plugin {

struct RealField {
  const char* name;
  double* decant_fields::* theirs;
  Eigen::VectorXd Fields::* scalar;   // null: a vector
  Eigen::Matrix3Xd Fields::* vector;  // null: a scalar

  std::size_t size(std::size_t fluid, std::size_t walls) const {
    return scalar == &Fields::boundary_volume ? walls : (vector ? 3 : 1) * fluid;
  }
};
inline constexpr RealField real_fields[] = {
    {"boundary_volume", &decant_fields::boundary_volume, &Fields::boundary_volume, nullptr},
    {"density", &decant_fields::density, &Fields::density, nullptr},
    {"pressure", &decant_fields::pressure, &Fields::pressure, nullptr},
    {"acceleration", &decant_fields::acceleration, nullptr, &Fields::acceleration},
    {"pressure_acceleration", &decant_fields::pressure_acceleration, nullptr, &Fields::pressure_acceleration},
    {"viscous_acceleration", &decant_fields::viscous_acceleration, nullptr, &Fields::viscous_acceleration},
    {"wall_pressure_acceleration", &decant_fields::wall_pressure_acceleration, nullptr,
     &Fields::wall_pressure_acceleration},
    {"wall_viscous_acceleration", &decant_fields::wall_viscous_acceleration, nullptr,
     &Fields::wall_viscous_acceleration},
};

struct CountField {
  const char* name;
  std::int64_t* decant_fields::* theirs;
  IdVector Fields::* ours;
};
inline constexpr CountField count_fields[] = {
    {"fluid_neighbor_count", &decant_fields::fluid_neighbor_count, &Fields::fluid_neighbor_count},
    {"fluid_neighbor_id_sum", &decant_fields::fluid_neighbor_id_sum, &Fields::fluid_neighbor_id_sum},
    {"wall_neighbor_count", &decant_fields::wall_neighbor_count, &Fields::wall_neighbor_count},
    {"wall_neighbor_id_sum", &decant_fields::wall_neighbor_id_sum, &Fields::wall_neighbor_id_sum},
};

}  // namespace decant::plugin
