/// \file
/// Fields computed elsewhere are judged as a backend's are, and what is not there never passes.
#include "oracle/files/results.hpp"

#include "oracle/solution/reference_backend.hpp"
#include "tests/results_fixture.hpp"
#include "tools/commands/reproducers.hpp"

#include <cmath>

namespace decant {
namespace {

using FixtureResults = test::ResultsFile;

/// Density as the sequential fp32 source has it.
void put_density(Hdf5Writer& out, const Eigen::VectorXd& density) {
  out.vector("/fields/density", density, "kg/m^3", "", Storage::fp32);
}

TEST_F(FixtureResults, AreJudgedAsALinkedBackendIs) {
  const auto backend = make_reference_backend(NeighborSearch::cells);
  const CheckSelection checks = results_checks();
  std::vector<CheckRow> linked = run_checks(*backend, *fixture_, *oracle_, checks);
  backend->load(fixture_->scene, oracle_->walls, fixture_->state);
  Fields own, staged;
  ASSERT_TRUE(backend->evaluate(own).ok());
  ASSERT_TRUE(backend->evaluate(staged, &oracle_->inputs).ok());
  ASSERT_TRUE(backend->advance(1).ok());
  ParticleState after;
  backend->read(after);
  write([&](Hdf5Writer& out) {
    for (const auto& field : stage_fields)
      out.vector(std::string("/fields/") + field.name, own.*field.member, field.unit);
    for (const auto& fact : neighbor_facts) out.integers(std::string("/fields/") + fact.name, own.*fact.member);
    for (const auto& field : acceleration_fields) {
      out.matrix3(std::string("/fields/") + field.name, own.*field.member, "m/s^2");
      out.matrix3(std::string("/staged/") + field.name, staged.*field.member, "m/s^2");
    }
    out.vector("/staged/pressure", staged.pressure, "Pa");
    out.matrix3("/substep/position", after.position, "m");
    out.matrix3("/substep/velocity", after.velocity, "m/s");
  });
  const ResultsOutcome outcome = judged();
  EXPECT_EQ(outcome.status, 0);
  ASSERT_EQ(outcome.report.rows.size(), linked.size());
  for (const CheckRow& row : linked) {
    const CheckRow& theirs = row_of(outcome, row.check, row.field);
    EXPECT_EQ(theirs.score, row.score) << row.check << row.field;
    EXPECT_EQ(theirs.tolerance, row.tolerance) << row.check << row.field;
    EXPECT_EQ(theirs.n, row.n) << row.check << row.field;
    EXPECT_EQ(theirs.unit, row.unit) << row.check << row.field;
    EXPECT_EQ(theirs.verdict, Verdict::pass) << row.check << row.field;
    EXPECT_EQ(theirs.executor, "file");
    EXPECT_EQ(theirs.backend, "port");
  }
}

TEST_F(FixtureResults, MayBePartialAndTheRestIsNotRun) {
  write([&](Hdf5Writer& out) { put_density(out, oracle_->own_fp32.density); });
  const ResultsOutcome outcome = judged();
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(row_of(outcome, "density", "density").verdict, Verdict::pass);
  EXPECT_EQ(row_of(outcome, "pressure", "pressure").verdict, Verdict::not_run);
  EXPECT_EQ(outcome.report.rows.size(), 22u);
  EXPECT_EQ(exit_status(outcome.report), 3) << "a report with fields that are not there passes";
  EXPECT_NE(outcome.line.find("1 rows given, 21 not given"), std::string::npos) << outcome.line;
  EXPECT_NE(outcome.table.find("not_run, not given: neighbors"), std::string::npos);
}

TEST_F(FixtureResults, WithNothingInThemAreNotRun) {
  write([](Hdf5Writer&) {});
  const ResultsOutcome outcome = judged();
  EXPECT_EQ(outcome.status, 3);
  EXPECT_NE(outcome.line.find("not_run"), std::string::npos) << outcome.line;
  const Eigen::Index n = fixture_->state.size();
  write([&](Hdf5Writer& out) { out.integers("/id", IdVector::LinSpaced(n, 0, n - 1)); });
  EXPECT_EQ(judged().status, 3) << "ids alone are no answer";
}

TEST_F(FixtureResults, FailByTheParticleThatIsWrong) {
  Eigen::VectorXd density = oracle_->own_fp32.density;
  density[17] *= 1.0001;
  write([&](Hdf5Writer& out) { put_density(out, density); });
  const ResultsOutcome outcome = judged();
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(row_of(outcome, "density", "density").verdict, Verdict::fail);
  EXPECT_EQ(row_of(outcome, "density", "density").worst_id, 17);
}

TEST_F(FixtureResults, SayWhereTheyFailAndCanBeCutOut) {
  Eigen::VectorXd density = oracle_->own_fp32.density;
  density[7] += 10;
  write([&](Hdf5Writer& out) { put_density(out, density); });
  const ResultsOutcome outcome = judged();
  const CheckRow& row = row_of(outcome, "density", "density");
  ASSERT_EQ(row.worst_id, 7);
  EXPECT_NEAR(row.worst_x, fixture_->state.position(0, 7), 1e-12);
  EXPECT_GT(row.fluid_neighbors, 0);
  const auto files = reproducers_of(outcome.report, *folder_ / "failing");
  ASSERT_EQ(files.size(), 1u);
  EXPECT_EQ(files[0].file.filename(), "beaker-port-density-density-7.h5");
  std::string warning;
  std::filesystem::create_directories(files[0].file.parent_path());
  (void)write_reproducer(files[0].file, *fixture_, row, warning);
  const Fixture around = read_fixture(files[0].file);
  EXPECT_LE(around.state.size(), fixture_->state.size());
  EXPECT_GT(around.state.size(), row.fluid_neighbors);
}

TEST_F(FixtureResults, FailWhereAValueIsNoNumber) {
  Eigen::VectorXd density = oracle_->own_fp32.density;
  density[3] = std::nan("");
  write([&](Hdf5Writer& out) { put_density(out, density); });
  EXPECT_EQ(judged().status, 1);
  Eigen::Matrix3Xd velocity = fixture_->state.velocity;
  velocity(1, 3) = std::nan("");
  write([&](Hdf5Writer& out) { out.matrix3("/substep/velocity", velocity, "m/s"); });
  EXPECT_EQ(row_of(judged(), "substep", "velocity").score, std::numeric_limits<double>::infinity());
}

TEST_F(FixtureResults, OfAnotherFixtureAreRefused) {
  const auto declaring = [](const std::string& sha256) {
    Hdf5Writer out(results_file());
    out.attribute("/", "decant_results", 1);
    if (!sha256.empty()) out.attribute("/", "fixture_sha256", sha256);
    out.commit();
  };
  declaring(std::string(64, 'a'));
  expect_refused(judged, "/@fixture_sha256");
  declaring("");
  expect_refused(judged, "/@fixture_sha256");
  write(
      [&](Hdf5Writer& out) { out.attribute("/", "particles", static_cast<std::int64_t>(fixture_->state.size() + 1)); });
  expect_refused(judged, "/@particles");
}

TEST_F(FixtureResults, MayNameTheirFixtureByItsParticles) {
  Hdf5Writer out(results_file());
  out.attribute("/", "decant_results", 1);
  out.attribute("/", "particles", static_cast<std::int64_t>(fixture_->state.size()));
  put_density(out, oracle_->own_fp32.density);
  out.commit();
  EXPECT_EQ(judged().status, 0);
}

TEST_F(FixtureResults, OfAnotherShapeTypeUnitOrNameAreRefused) {
  const Eigen::VectorXd density = oracle_->own_fp32.density;
  const Eigen::Index n = density.size();
  write([&](Hdf5Writer& out) { put_density(out, density.head(n - 1)); });
  expect_refused(judged, "/fields/density");
  write([&](Hdf5Writer& out) { out.matrix3("/fields/density", Eigen::Matrix3Xd::Zero(3, n), "kg/m^3"); });
  expect_refused(judged, "/fields/density");
  write([&](Hdf5Writer& out) { out.vector("/fields/wall_neighbor_count", density, ""); });
  expect_refused(judged, "/fields/wall_neighbor_count");
  write([&](Hdf5Writer& out) { out.vector("/fields/density", density, "g/cm^3"); });
  expect_refused(judged, "/fields/density@unit");
  write([&](Hdf5Writer& out) { out.vector("/fields/densty", density, "kg/m^3"); });
  expect_refused(judged, "/fields/densty");
}

TEST_F(FixtureResults, InAnotherOrderAreMatchedById) {
  const Eigen::VectorXd density = oracle_->own_fp32.density;
  const Eigen::Index n = density.size();
  const Eigen::VectorXd backwards = density.reverse();
  write([&](Hdf5Writer& out) {
    put_density(out, backwards);
    out.integers("/id", IdVector::LinSpaced(n, 0, n - 1).reverse());
  });
  EXPECT_EQ(judged().status, 0);
  write([&](Hdf5Writer& out) { put_density(out, backwards); });
  EXPECT_EQ(judged().status, 1) << "the order shows in the values";
}

TEST_F(FixtureResults, FailByNameWhereIdsAreMissingOrDoubled) {
  const Eigen::VectorXd density = oracle_->own_fp32.density;
  const Eigen::Index n = density.size();
  IdVector id = IdVector::LinSpaced(n, 0, n - 1);
  id[5] = 6;
  write([&](Hdf5Writer& out) {
    put_density(out, density);
    out.vector("/fields/boundary_volume", oracle_->own_fp32.boundary_volume, "m^3");
    out.integers("/id", id);
  });
  ResultsOutcome outcome = judged();
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(row_of(outcome, "ids", "id").verdict, Verdict::fail);
  EXPECT_EQ(row_of(outcome, "ids", "id").reason, "id 5 is missing, id 6 is there 2 times");
  EXPECT_EQ(row_of(outcome, "density", "density").verdict, Verdict::not_run);
  EXPECT_EQ(row_of(outcome, "boundary_volume", "boundary_volume").verdict, Verdict::pass) << "walls have no part in it";

  write([&](Hdf5Writer& out) {
    put_density(out, density.head(n - 2));
    out.integers("/id", IdVector::LinSpaced(n - 2, 0, n - 3));
  });
  outcome = judged();
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(row_of(outcome, "ids", "id").error, 2);
}

TEST_F(FixtureResults, NeedOneFixtureAndChecksThatAFileCanAnswer) {
  write([](Hdf5Writer&) {});
  expect_refused([] { return check_results_file({results_file(), {}, "", "", {}}); }, "FIXTURE");
  expect_refused([] { return check_results_file({results_file(), {fixture_file()}, "", "", {"mass"}}); }, "--check");
}

}  // namespace
}  // namespace decant
