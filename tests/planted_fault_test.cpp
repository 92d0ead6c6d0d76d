/// \file
/// The suite is worth what it catches: every fault of a catalogue must fail the check that is there
/// for it, and the solver without a fault must pass every check.
#include "oracle/checks/conform.hpp"
#include "oracle/files/fixture_file.hpp"
#include "tests/edited_reference.hpp"

#include "reference/kernel.hpp"
#include "reference/sampling.hpp"
#include "tests/special_values.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <ostream>

namespace decant {
namespace {

using test::Edit;
using test::EditedReference;

using test::nan;

struct Fault {
  const char* name;
  const char* check;  // that must catch it
  const char* field;
  Edit edit;
};
void PrintTo(const Fault& fault, std::ostream* out) { *out << fault.name; }

Edit scene_edit(std::function<void(Scene&)> change) {
  Edit edit;
  edit.loaded = [change](Scene& scene, ParticleState&) { change(scene); };
  return edit;
}

Edit state_edit(std::function<void(ParticleState&)> change) {
  Edit edit;
  edit.loaded = [change](Scene&, ParticleState& state) { change(state); };
  return edit;
}

Edit list_edit(std::function<void(Neighbors&)> change) {
  Edit edit;
  edit.found = [change](const Scene&, Neighbors& near, Eigen::VectorXd&) { change(near); };
  return edit;
}

Edit field_edit(std::function<void(const Scene&, Fields&)> change) {
  Edit edit;
  edit.evaluated = std::move(change);
  return edit;
}

Edit result_edit(std::function<void(ParticleState&)> change) {
  Edit edit;
  edit.advanced = std::move(change);
  return edit;
}

/// The last substep of the runs on the recording below.
constexpr std::int64_t last_substep = 12444 + 32;

Edit at_the_end(std::function<void(ParticleState&)> change) {
  return result_edit([change](ParticleState& s) {
    if (s.substep == last_substep) change(s);
  });
}

std::vector<std::int32_t>& longest(std::vector<std::vector<std::int32_t>>& lists) {
  return *std::max_element(lists.begin(), lists.end(),
                           [](const auto& a, const auto& b) { return a.size() < b.size(); });
}

Edit volume_edit() {
  Edit edit;
  edit.found = [](const Scene& scene, Neighbors&, Eigen::VectorXd& volumes) {
    volumes.setConstant(std::pow(scene.particle_spacing, 3));
  };
  edit.evaluated = [](const Scene& scene, Fields& out) {
    out.boundary_volume.setConstant(std::pow(scene.particle_spacing, 3));
  };
  return edit;
}

const Fault catalogue[] = {
    {"DroppedNeighbor", "neighbors", "fluid_neighbor_count",
     list_edit([](Neighbors& n) { longest(n.fluid).pop_back(); })},
    {"DroppedNeighborShowsInDensity", "density", "density", list_edit([](Neighbors& n) {
       for (auto& list : n.fluid)
         if (list.size() > 20) list.pop_back();
     })},
    {"NeighborCountedTwice", "neighbors", "fluid_neighbor_count",
     list_edit([](Neighbors& n) { longest(n.fluid).push_back(longest(n.fluid).back()); })},
    {"AnotherNeighborInItsPlace", "neighbors", "fluid_neighbor_id_sum", list_edit([](Neighbors& n) {
       auto& list = longest(n.fluid);
       list[0] = list[1];
     })},
    {"ListCutAtThirty", "neighbors", "fluid_neighbor_count", list_edit([](Neighbors& n) {
       for (auto& list : n.fluid)
         if (list.size() > 30) list.resize(30);
     })},
    {"DroppedWallNeighbor", "neighbors", "wall_neighbor_count",
     list_edit([](Neighbors& n) { longest(n.wall).pop_back(); })},
    {"NoWallTerm", "acceleration", "wall_pressure_acceleration", list_edit([](Neighbors& n) {
       for (auto& list : n.wall) list.clear();
     })},
    {"WallsUnnormalised", "boundary_volume", "boundary_volume", volume_edit()},
    {"DensityWithoutSelf", "density", "density", field_edit([](const Scene& s, Fields& f) {
       f.density.array() -= s.particle_mass() * Kernel<double>(s.kernel, s.support_radius()).W(0);
     })},
    {"KernelConstantOffByOneInAHundredThousand", "density", "density",
     field_edit([](const Scene&, Fields& f) { f.density *= 1 + 1e-5; })},
    {"PressureTensionNotClamped", "pressure", "pressure", scene_edit([](Scene& s) { s.fluid.allow_tension = true; })},
    {"LinearEquationOfState", "pressure", "pressure", scene_edit([](Scene& s) { s.fluid.eos_exponent = 1; })},
    {"ViscosityOffByAPercent", "acceleration", "viscous_acceleration",
     scene_edit([](Scene& s) { s.fluid.viscosity *= 1.01; })},
    {"WallViscosityOffByAPercent", "acceleration", "wall_viscous_acceleration",
     scene_edit([](Scene& s) { s.fluid.wall_viscosity *= 1.01; })},
    {"GravityUpward", "acceleration", "acceleration", scene_edit([](Scene& s) { s.gravity = -s.gravity; })},
    {"SourceOneSubstepLate", "acceleration", "wall_pressure_acceleration",
     state_edit([](ParticleState& s) { --s.substep; })},
    {"VelocitiesOfAnotherOrder", "acceleration", "viscous_acceleration",
     state_edit([](ParticleState& s) { s.velocity.col(0).swap(s.velocity.col(s.size() - 1)); })},
    {"SwappedIds", "density", "density", field_edit([](const Scene&, Fields& f) {
       Eigen::Index low, high;
       f.density.minCoeff(&low);
       f.density.maxCoeff(&high);
       std::swap(f.density[low], f.density[high]);
     })},
    {"NanLane", "density", "density", field_edit([](const Scene&, Fields& f) {
       for (Eigen::Index i = 7; i < f.density.size(); i += 32) f.density[i] = nan;
     })},
    {"OneValueNotWritten", "pressure", "pressure",
     field_edit([](const Scene&, Fields& f) { f.pressure.tail(1) = Fields::unwritten(1, 0).pressure; })},
    {"NothingWritten", "evaluation", "acceleration",
     field_edit([](const Scene&, Fields& f) { f = Fields::unwritten(f.density.size(), f.boundary_volume.size()); })},
    {"TooFewValues", "density", "density",
     field_edit([](const Scene&, Fields& f) { f.density.conservativeResize(f.density.size() - 1); })},
    {"HalfTheTimeStep", "substep", "velocity", scene_edit([](Scene& s) { s.schedule.substeps_per_frame *= 2; })},
    {"ContactCloserByAPercent", "substep", "position", scene_edit([](Scene& s) { s.contact.distance_ratio *= 0.99; })},
    {"NoFriction", "substep", "velocity", scene_edit([](Scene& s) { s.contact.friction = 0; })},
    {"FrictionOffByAThousandth", "contact", "velocity", scene_edit([](Scene& s) { s.contact.friction *= 1.001; })},
    {"RestitutionOffByAThousandth", "contact", "velocity",
     scene_edit([](Scene& s) { s.contact.restitution *= 1.001; })},
    {"NeighborLostInARun", "advanced", "fluid_neighbor_count after 9",
     [] {
       Edit edit;
       edit.found = [searches = 0](const Scene&, Neighbors& n, Eigen::VectorXd&) mutable {
         if (++searches > 5) longest(n.fluid).pop_back();
       };
       return edit;
     }()},
    {"StateSwapped", "substep", "position",
     result_edit([](ParticleState& s) { s.position.col(1).swap(s.position.col(2)); })},
    {"StateNan", "substep", "velocity", result_edit([](ParticleState& s) { s.velocity(2, 5) = nan; })},
    {"SourceLateInARun", "trajectory", "rms_position", state_edit([](ParticleState& s) { --s.substep; })},
    {"ParticleGoneAtTheEnd", "mass", "finite",
     at_the_end([](ParticleState& s) { s.position.col(9).setConstant(nan); })},
    {"ParticleTwice", "mass", "distinct", at_the_end([](ParticleState& s) {
       s.position.col(3) = s.position.col(4);
       s.velocity.col(3) = s.velocity.col(4);
     })},
    {"ParticleOutsideTheDomain", "mass", "lost", at_the_end([](ParticleState& s) { s.position(0, 17) = 2; })},
    {"ParticleInTheReceiversBottom", "containment", "depth",
     at_the_end([](ParticleState& s) { s.position.col(20) = Vec3(0, 0, 0.0045); })},
    {"ParticleThroughTheReceiversBottom", "containment", "crossings",
     [] {
       Edit edit;
       edit.advanced = [](ParticleState& s) {
         if (s.substep == last_substep - 1) s.position.col(20) = Vec3(0, 0, 0.012);
         if (s.substep == last_substep) s.position.col(20) = Vec3(0, 0, -0.004);
       };
       return edit;
     }()},
    {"PairSeenFromOneSide", "conservation", "pressure_momentum",
     list_edit([](Neighbors& n) { longest(n.fluid).pop_back(); })},
    {"AnotherRunEveryTime", "determinism", "run",
     [] {
       Edit edit;
       edit.advanced = [runs = 0](ParticleState& s) mutable { s.velocity(0, 8) += 1e-13 * ++runs; };
       return edit;
     }()},
    {"AnotherFieldEveryTime", "determinism", "fields",
     [] {
       Edit edit;
       edit.evaluated = [calls = 0](const Scene&, Fields& f) mutable { f.density[0] *= 1 + 1e-15 * ++calls; };
       return edit;
     }()},
    {"OriginTakenForGranted", "invariance", "translated density",
     [] {
       Edit edit;
       edit.loaded = [](Scene& scene, ParticleState& s) {
         if (scene.domain.min.x() == 0) s.position.col(0) += Vec3::Constant(1e-5);
       };
       return edit;
     }()},
    {"TurnedFallsAslant", "invariance", "rotated acceleration", scene_edit([](Scene& s) {
       if (s.containers[0].origin.x() == 0) s.gravity.y() = 1e-3;
     })},
    {"FirstIdSpecial", "invariance", "permuted density", list_edit([](Neighbors& n) { n.fluid[0].clear(); })},
};

class PlantedFault : public testing::TestWithParam<Fault> {
 protected:
  static const Fixture& recorded() {
    static const Fixture fixture = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-stream.h5");
    return fixture;
  }
  static const PreparedReference& oracle() {
    static const PreparedReference prepared = prepare_reference(recorded());
    return prepared;
  }
  /// The check whose row this is.
  static CheckSelection check_of(const std::string& row) { return {all_checks().count(row) ? row : "fields"}; }
};

TEST_P(PlantedFault, FailsTheCheckThatIsThereForIt) {
  EditedReference backend(GetParam().edit);
  double margin = -1;
  for (const CheckRow& row : run_checks(backend, recorded(), oracle(), check_of(GetParam().check)))
    if (row.check == GetParam().check && row.field == GetParam().field) {
      EXPECT_EQ(verdict_of(row), Verdict::fail) << "score " << row.score;
      margin = row.score;
    }
  ASSERT_GT(margin, 1) << "no such check";
  RecordProperty("margin", std::to_string(margin));
}

/// Looked at after every substep, a path through a wall is found at the substep that made it.
TEST(Containment, NamesTheSubstepWhereAsked) {
  const Fixture fixture = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-stream.h5");
  Edit edit;
  edit.advanced = [&](ParticleState& s) {
    if (s.substep - fixture.state.substep >= 5) s.position.col(20) = Vec3(0, 0, 0.012);
  };
  const CheckSelection alone{"containment"};
  for (const auto& [sample_every, found] : {std::pair(1, "first seen 5 "), std::pair(0, "first seen 9 ")}) {
    EditedReference backend(edit);
    std::string reason;
    for (const CheckRow& row : run_checks(backend, fixture, prepare_reference(fixture, alone, sample_every), alone))
      if (row.field == "crossings") reason = row.reason;
    EXPECT_NE(reason.find(found), std::string::npos) << reason;
  }
}

/// The equation of state alone, and the walls' drag alone, are sharper than whatever follows from a density.
TEST(SmallestFactors, AreCaughtOnAPour) {
  const Fixture fixture = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-filling.h5");
  const PreparedReference oracle = prepare_reference(fixture, {"fields"});
  const auto score = [&](const Edit& edit, const char* check, const char* field) {
    EditedReference backend(edit);
    for (const CheckRow& row : run_checks(backend, fixture, oracle, {"fields"}))
      if (row.check == std::string(check) && row.field == field) return row.score;
    return -1.0;
  };
  EXPECT_GT(
      score(scene_edit([](Scene& s) { s.fluid.sound_speed *= std::sqrt(1 + 1e-5); }), "equation_of_state", "pressure"),
      1);
  EXPECT_GT(score(scene_edit([](Scene& s) {
                    // gamma alone: B = rho0 c0²/gamma stays
                    s.fluid.eos_exponent *= 1 + 1e-5;
                    s.fluid.sound_speed *= std::sqrt(1 + 1e-5);
                  }),
                  "equation_of_state", "pressure"),
            1);
  EXPECT_GT(score(scene_edit([](Scene& s) { s.fluid.wall_viscosity *= 1 + 3e-5; }), "acceleration",
                  "wall_viscous_acceleration"),
            1);
  EXPECT_LT(score(Edit{}, "equation_of_state", "pressure"), 1e-3);
}

/// What one evaluation shows thousandfold must show in runs too, wherever viscosity matters.
TEST(Trajectory, ShowsAPercentOfViscosityInItsEnergy) {
  for (const char* phase : {"settled", "splash"}) {
    const Fixture fixture = read_fixture(std::string(DECANT_SOURCE_DIR "/fixtures/pour-4k-") + phase + ".h5");
    EditedReference backend(scene_edit([](Scene& s) { s.fluid.viscosity *= 1.01; }));
    for (const CheckRow& row :
         run_checks(backend, fixture, prepare_reference(fixture, {"trajectory"}), {"trajectory"})) {
      if (row.field == "energy") {
        EXPECT_GT(row.score, 1) << phase;
      }
      RecordProperty(std::string(phase) + " " + row.field, std::to_string(row.score));
    }
  }
}

/// The bound is wide enough: a run that is perturbed as the ensemble was, by other numbers, passes.
TEST(Trajectory, PassesPerturbedRuns) {
  const Fixture fixture = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-stream.h5");
  const Ensemble others =
      run_ensemble(fixture.scene, sample_walls(fixture.scene), fixture.state, fixture.ensemble.substeps, 4, 99);
  const Divergence bound = divergence_bound(fixture.ensemble);
  for (std::size_t k = 0; k < bound.size(); ++k) {
    EXPECT_LT(others.mean[k] + 3 * others.deviation[k], bound[k]) << divergence_names[k];
    EXPECT_GT(others.mean[k], 0.02 * bound[k]) << divergence_names[k];
  }
}

INSTANTIATE_TEST_SUITE_P(Catalogue, PlantedFault, testing::ValuesIn(catalogue),
                         [](const auto& chosen) { return std::string(chosen.param.name); });

TEST(NoFault, PassesEveryCheckFarWithinTolerance) {
  const Fixture fixture = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-stream.h5");
  EditedReference backend{Edit{}};
  for (const CheckRow& row : run_checks(backend, fixture, prepare_reference(fixture))) {
    EXPECT_EQ(verdict_of(row), Verdict::pass) << row.check << " " << row.field << row.reason;
    // Double against double: what is left is the order of sums; runs are compared with an ensemble.
    EXPECT_LT(row.score, 1e-3) << row.check << " " << row.field;
  }
}

/// What is left out of a comparison, because fp32 cannot decide it, must be sane all the same.
TEST(NotANumber, DoesNotHideAmongTheAmbiguous) {
  const Fixture fixture = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-stream.h5");
  const PreparedReference oracle = prepare_reference(fixture, {"fields", "substep"});
  const auto chosen = [](const std::vector<bool>& ambiguous) {
    return std::find(ambiguous.begin(), ambiguous.end(), true) - ambiguous.begin();
  };
  const Eigen::Index contact = chosen(oracle.substep.ambiguous), near_wall = chosen(oracle.own.wall_ambiguous);
  ASSERT_LT(contact, fixture.state.size());
  ASSERT_LT(near_wall, fixture.state.size());
  const auto verdict = [&](const Edit& edit, const std::string& field) {
    EditedReference backend(edit);
    for (const CheckRow& row : run_checks(backend, fixture, oracle, {"fields", "substep"}))
      if (row.field == field) return verdict_of(row);
    return Verdict::not_run;
  };
  for (const double bad : {nan, 1e30}) {
    EXPECT_EQ(verdict(result_edit([&](ParticleState& s) { s.position(0, contact) = bad; }), "position"), Verdict::fail);
    EXPECT_EQ(verdict(result_edit([&](ParticleState& s) { s.velocity(2, contact) = bad; }), "velocity"), Verdict::fail);
  }
  EXPECT_EQ(verdict(field_edit([&](const Scene&, Fields& f) { f.wall_neighbor_count[near_wall] = -1; }),
                    "wall_neighbor_count"),
            Verdict::fail);
}

/// Whatever field a NaN or an infinity is in, and wherever, some check on that field fails.
TEST(NotANumber, NeverPasses) {
  const Fixture fixture = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-stream.h5");
  const PreparedReference oracle = prepare_reference(fixture, {"fields"});
  const std::vector<std::pair<std::string, Eigen::VectorXd Fields::*>> scalars = {
      {"boundary_volume", &Fields::boundary_volume}, {"density", &Fields::density}, {"pressure", &Fields::pressure}};
  const std::vector<std::pair<std::string, Eigen::Matrix3Xd Fields::*>> vectors = {
      {"pressure_acceleration", &Fields::pressure_acceleration},
      {"viscous_acceleration", &Fields::viscous_acceleration},
      {"wall_pressure_acceleration", &Fields::wall_pressure_acceleration},
      {"wall_viscous_acceleration", &Fields::wall_viscous_acceleration},
      {"acceleration", &Fields::acceleration}};
  const auto expect_fails = [&](const std::string& field, const Edit& edit) {
    EditedReference backend(edit);
    int failed = 0;
    for (const CheckRow& row : run_checks(backend, fixture, oracle, {"fields"}))
      failed += row.field == field && verdict_of(row) == Verdict::fail;
    EXPECT_GT(failed, 0) << field;
  };
  for (const double bad : {nan, -nan, std::numeric_limits<double>::infinity()}) {
    for (const auto& [name, member] : scalars)
      expect_fails(name, field_edit([&, m = member](const Scene&, Fields& f) { (f.*m)[11] = bad; }));
    for (const auto& [name, member] : vectors)
      expect_fails(name, field_edit([&, m = member](const Scene&, Fields& f) { (f.*m)(1, 17) = bad; }));
  }
}

}  // namespace
}  // namespace decant
