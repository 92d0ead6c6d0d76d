/// \file
/// The checks `fields`, `substep` and `conservation` of values that are already there, whoever
/// computed them: a backend that was run, or a file.
#pragma once

#include "oracle/checks/comparison.hpp"
#include "oracle/checks/conform.hpp"

#include <set>
#include <string>

namespace decant {

struct AccelerationField {
  const char* name;
  Eigen::Matrix3Xd Fields::* member;
};
/// The four parts, and their sum with gravity.
inline constexpr AccelerationField acceleration_fields[] = {
    {"pressure_acceleration", &Fields::pressure_acceleration},
    {"viscous_acceleration", &Fields::viscous_acceleration},
    {"wall_pressure_acceleration", &Fields::wall_pressure_acceleration},
    {"wall_viscous_acceleration", &Fields::wall_viscous_acceleration},
    {"acceleration", &Fields::acceleration},
};

struct NeighborFact {
  const char* name;
  IdVector Fields::* member;
  bool of_walls;
};
inline constexpr NeighborFact neighbor_facts[] = {
    {"fluid_neighbor_count", &Fields::fluid_neighbor_count, false},
    {"fluid_neighbor_id_sum", &Fields::fluid_neighbor_id_sum, false},
    {"wall_neighbor_count", &Fields::wall_neighbor_count, true},
    {"wall_neighbor_id_sum", &Fields::wall_neighbor_id_sum, true},
};

struct StageField {
  const char* name;
  Eigen::VectorXd Fields::* member;
  const char* unit;
};
inline constexpr StageField stage_fields[] = {
    {"boundary_volume", &Fields::boundary_volume, "m^3"},
    {"density", &Fields::density, "kg/m^3"},
    {"pressure", &Fields::pressure, "Pa"},
};

/// Which fields somebody answered, by the names above, and "position", "velocity". A field that was
/// not answered gets a row all the same, not_run.
using Answered = std::set<std::string>;

/// What a backend that was run has answered: everything.
const Answered& all_answered();

/// The fields among what is offered (Offer).
Answered answered_by(std::uint32_t offers);

/// Reason of a row that nobody answered.
inline constexpr const char* not_given = "not given";

/// Rows `neighbors`, `boundary_volume`, `density`, `pressure`, each from the stage before.
void check_stages(const Fields& got, const Answered& answered, const PreparedReference& oracle, RowBuilder& builder);

/// Rows `equation_of_state`, `acceleration`: from the oracle's own density and pressure.
void check_staged(const Fields& got, const Answered& answered, const PreparedReference& oracle, RowBuilder& builder);

/// Row `evaluation`: accelerations from one's own density and pressure.
void check_evaluation(const Fields& got, const Answered& answered, const PreparedReference& oracle,
                      RowBuilder& builder);

/// What particles may be, each in the outcome that position and velocity together are nearest to, by score.
struct NearestOutcomes {
  Eigen::Matrix3Xd position, velocity;                      // 3×N, m, m/s
  Eigen::Matrix3Xd position_tolerance, velocity_tolerance;  // 3×N, m, m/s
};
/// \param outcomes  per particle at least one; \param got  of another number of particles: the first ones
NearestOutcomes nearest_outcomes(const std::vector<std::vector<SubstepOutcome>>& outcomes, const ParticleState& got);

/// Positions as the images nearest to the first outcomes: where fp32 cannot tell on which side of a period a
/// particle came back in, both are the same point. One that was not put back into its period stays.
ParticleState nearest_images(ParticleState got, const Scene& scene,
                             const std::vector<std::vector<SubstepOutcome>>& outcomes);

/// Row `substep`. Position and velocity, as far as answered, are held together to the outcome that
/// they are nearest to.
/// \param got  one substep after the fixture's state, in id order
void check_substep(const ParticleState& got, const Answered& answered, const Fixture& fixture,
                   const PreparedReference& oracle, RowBuilder& builder);

/// Rows of neighbor facts, density, pressure and accelerations against the oracle's answer at the same
/// state. \param after  follows each field's name, as in "density after 3"
void check_fields(const char* check, const std::string& after, const Fields& got, const ReferenceSolution& oracle,
                  RowBuilder& builder);

/// Row `conservation`: what the parts of `check_staged` that act between fluid particles add up to.
void check_momentum(const Fields& got, const Answered& answered, const Fixture& fixture,
                    const PreparedReference& oracle, RowBuilder& builder);

}  // namespace decant
