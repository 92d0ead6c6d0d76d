/// \file
/// A failure is told with its particle's neighborhood, and shows again in a fixture cut out of
/// them.
#include "tools/commands/reproducers.hpp"
#include "oracle/files/fixture_file.hpp"
#include "oracle/report/console_table.hpp"

#include "oracle/checks/conform.hpp"
#include "oracle/checks/neighborhood.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "tests/edited_reference.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <regex>
#include <sstream>

namespace decant {
namespace {

using test::Edit;
using test::EditedReference;

const Fixture& recorded() {
  static const Fixture fixture = [] {
    Fixture f = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-stream.h5");
    f.ensemble.substeps = 2;  // a reproducer runs its own, and its length does not matter here
    f.ensemble.members = 2;
    return f;
  }();
  return fixture;
}

const PreparedReference& oracle() {
  static const PreparedReference prepared = prepare_reference(recorded(), {"fields"});
  return prepared;
}

Edit lists_cut_at_thirty() {
  Edit edit;
  edit.found = [](const Scene&, Neighbors& near, Eigen::VectorXd&) {
    for (auto& list : near.fluid)
      if (list.size() > 30) list.resize(30);
  };
  return edit;
}

Edit viscosity_off_by_a_percent() {
  Edit edit;
  edit.loaded = [](Scene& scene, ParticleState&) { scene.fluid.viscosity *= 1.01; };
  return edit;
}

Edit wall_viscosity_off_by_a_percent() {
  Edit edit;
  edit.loaded = [](Scene& scene, ParticleState&) { scene.fluid.wall_viscosity *= 1.01; };
  return edit;
}

Edit volumes_off() {
  Edit edit;
  edit.evaluated = [](const Scene&, Fields& f) { f.boundary_volume *= 1.01; };
  return edit;
}

std::vector<CheckRow> judged(const Edit& edit) {
  EditedReference backend(edit);
  return run_checks(backend, recorded(), oracle(), {"fields"});
}

const CheckRow& row_of(const std::vector<CheckRow>& rows, std::string_view check, std::string_view field) {
  for (const CheckRow& row : rows)
    if (row.check == check && row.field == field) return row;
  throw std::logic_error("no row " + std::string(check) + " " + std::string(field));
}

TEST(FailingRow, TellsValuePlaceAndNeighborsOfItsWorstParticle) {
  constexpr Eigen::Index i = 1234;
  const Fields& fields = *recorded().fields;
  Edit edit;
  edit.evaluated = [&](const Scene&, Fields& f) { f.density[i] += 10; };
  const auto rows = judged(edit);
  const CheckRow& row = row_of(rows, "density", "density");
  ASSERT_EQ(row.worst_id, i);
  EXPECT_EQ(row.worst_component, -1);
  EXPECT_NEAR(row.expected, fields.density[i], 1e-6);
  EXPECT_NEAR(row.actual, fields.density[i] + 10, 1e-6);
  EXPECT_EQ(Vec3(row.worst_x, row.worst_y, row.worst_z), recorded().state.position.col(i));
  EXPECT_EQ(row.fluid_neighbors, fields.fluid_neighbor_count[i]);
  EXPECT_EQ(row.wall_neighbors, fields.wall_neighbor_count[i]);

  std::istringstream ids(row.nearest);
  double last = 0;
  int named = 0;
  for (Eigen::Index id; ids >> id; ++named) {
    const double distance = (recorded().state.position.col(id) - recorded().state.position.col(i)).norm();
    EXPECT_GT(distance, last);
    last = distance;
  }
  EXPECT_EQ(named, 8);
  std::int64_t closer = 0;
  for (Eigen::Index j = 0; j < recorded().state.size(); ++j)
    closer += j != i && (recorded().state.position.col(j) - recorded().state.position.col(i)).norm() <= last;
  EXPECT_EQ(closer, 8);
  EXPECT_FALSE(is_located(row_of(rows, "pressure", "pressure")));

  const std::string text = std::regex_replace(in_full(row), std::regex("\n    "), " ");
  EXPECT_NE(text.find("particle 1234: error 10 kg/m^3"), std::string::npos) << text;
  EXPECT_NE(text.find("actual 1012.29368, expected 1002.29368 kg/m^3; at ("), std::string::npos) << text;
  EXPECT_NE(text.find("34 fluid neighbors, nearest " + row.nearest + "; 0 wall neighbors"), std::string::npos) << text;
}

TEST(FailingRow, OfAVectorNamesTheComponent) {
  Edit edit;
  edit.evaluated = [&](const Scene&, Fields& f) { f.acceleration(2, 1234) -= 50; };
  const CheckRow row = row_of(judged(edit), "acceleration", "acceleration");
  EXPECT_EQ(row.worst_id, 1234);
  EXPECT_EQ(row.worst_component, 2);
  EXPECT_NE(console_table({{row}, {}}).find("z: actual "), std::string::npos);
}

TEST(FailingRow, OfBoundaryVolumesIsAtAWallParticle) {
  const CheckRow row = row_of(judged(volumes_off()), "boundary_volume", "boundary_volume");
  const PosedWalls posed =
      pose_walls(recorded().scene, oracle().walls, recorded().scene.time_at(recorded().state.substep));
  EXPECT_EQ(Vec3(row.worst_x, row.worst_y, row.worst_z), posed.position.col(row.worst_id));
  EXPECT_NE(console_table({{row}, {}}).find("wall particle "), std::string::npos);
}

TEST(FailingRow, OfAPermutedProblemNamesTheFixturesParticle) {
  const PreparedReference turned = prepare_reference(recorded(), {"invariance"});
  Edit edit;
  edit.found = [](const Scene&, Neighbors& near, Eigen::VectorXd&) { near.fluid[0].clear(); };
  EditedReference backend(edit);
  const auto rows = run_checks(backend, recorded(), turned, {"invariance"});
  EXPECT_EQ(row_of(rows, "invariance", "permuted density").worst_id, turned.transformed.at(0).problem.original.at(0));
  EXPECT_EQ(row_of(rows, "invariance", "translated density").worst_id, 0);
}

class ReproducerOf : public testing::TestWithParam<std::tuple<const char*, const char*, Edit (*)()>> {};

TEST_P(ReproducerOf, KeepsTheParticlesBitsAndShowsTheFailureAgain) {
  const auto& [check, field, edit] = GetParam();
  const CheckRow row = row_of(judged(edit()), check, field);
  const TemporaryFolder folder;
  const auto file = folder / "reproducer.h5";
  std::string warning;
  const std::string line = write_reproducer(file, recorded(), row, warning);
  EXPECT_EQ(warning, "");
  const Reproducer reproducer = reproducer_of(recorded(), row, reproducer_radius * recorded().scene.support_radius());
  ASSERT_EQ(reproducer.id[reproducer.particle], row.worst_id);

  const Fixture written = read_fixture(file);
  const PreparedReference its_oracle = prepare_reference(written, {"fields"});
  EXPECT_LT(written.state.size(), recorded().state.size() / 2);
  const Fields &was = oracle().own.fields, &is = *written.fields;
  EXPECT_EQ(is.density[reproducer.particle], was.density[row.worst_id]);
  EXPECT_EQ(is.pressure[reproducer.particle], was.pressure[row.worst_id]);
  EXPECT_EQ(Vec3(is.acceleration.col(reproducer.particle)), Vec3(was.acceleration.col(row.worst_id)));
  const std::string here = "particle " + std::to_string(row.worst_id) + ", here " + std::to_string(reproducer.particle);
  EXPECT_EQ(written.provenance.at("cut_around"), here);
  EXPECT_NE(line.find(here), std::string::npos) << line;
  EXPECT_EQ(written.provenance.at("advanced_by"), recorded().provenance.at("advanced_by"));

  EditedReference backend(edit());
  const CheckRow again = row_of(run_checks(backend, written, its_oracle, {"fields"}), check, field);
  EXPECT_EQ(verdict_of(again), Verdict::fail);
  EXPECT_EQ(again.errors[reproducer.particle * (again.errors.size() / written.state.size())],
            row.errors[row.worst_id * (row.errors.size() / recorded().state.size())]);
}

INSTANTIATE_TEST_SUITE_P(Faults, ReproducerOf,
                         testing::Values(std::tuple{"neighbors", "fluid_neighbor_count", &lists_cut_at_thirty},
                                         std::tuple{"density", "density", &lists_cut_at_thirty},
                                         std::tuple{"acceleration", "viscous_acceleration",
                                                    &viscosity_off_by_a_percent}),
                         [](const auto& chosen) { return std::string(std::get<1>(chosen.param)); });

TEST(Reproducers, AreOneABackendAndFixtureOfTheFirstRowThatFailsAtAFluidParticle) {
  const auto row = [](const char* backend, const char* check, const char* field, std::int64_t id) {
    CheckRow r;
    r.backend = backend;
    r.executor = "host";
    r.fixture = "pour";
    r.check = check;
    r.field = field;
    r.worst_id = id;
    r.verdict = Verdict::fail;
    r.score = 31;
    if (id >= 0) r.worst_x = r.worst_y = r.worst_z = 0;
    r.fluid_neighbors = 3;
    return r;
  };
  Report report;
  report.rows = {row("brute", "trajectory", "energy", -1), row("brute", "boundary_volume", "boundary_volume", 5),
                 row("brute", "invariance", "translated density", 6), row("brute", "density", "density", 7),
                 row("hash", "boundary_volume", "boundary_volume", 8)};
  report.rows.push_back(row("hash", "density", "density", 9));
  report.rows.back().options = "sort=thrust:threads_per_particle=4";
  report.rows.push_back(row("list", "density", "density", 10));
  report.rows.back().verdict = Verdict::pass;
  report.rows.back().score = 0.5;
  std::vector<std::string> names;
  for (const ReproducerFile& reproducer : reproducers_of(report, "out")) names.push_back(reproducer.file.string());
  EXPECT_EQ(names, (std::vector<std::string>{"out/pour-brute-invariance-translated-density-6.h5",
                                             "out/pour-hash-boundary_volume-boundary_volume-8.h5",
                                             "out/pour-hash-sort-thrust-threads_per_particle-4-density-density-9.h5"}));
}

TEST(Neighborhood, HoldFluidAndWallsWithinTheirRadiusWithTheRowsScores) {
  const CheckRow row = row_of(judged(wall_viscosity_off_by_a_percent()), "acceleration", "wall_viscous_acceleration");
  const double radius = 6 * recorded().scene.support_radius();
  const Neighborhood s = neighborhood_of(recorded(), oracle().walls, oracle().own.fields.density, row, 12, radius);
  const Vec3 center(row.worst_x, row.worst_y, row.worst_z);
  int fluid = 0, worst = 0;
  for (Eigen::Index k = 0; k < s.position.cols(); ++k) {
    EXPECT_LT((s.position.col(k) - center).norm(), radius);
    EXPECT_EQ(std::isnan(s.score[k]), s.wall[static_cast<std::size_t>(k)] == 1);
    if (s.wall[static_cast<std::size_t>(k)]) continue;
    ++fluid;
    EXPECT_EQ(s.density[k], oracle().own.fields.density[s.id[k]]);
    EXPECT_LE(s.score[k], row.score);
    worst += s.id[k] == row.worst_id && s.score[k] == row.score;
  }
  EXPECT_EQ(worst, 1);
  EXPECT_GT(fluid, 20);
  EXPECT_LT(fluid, s.position.cols());
}

}  // namespace
}  // namespace decant
