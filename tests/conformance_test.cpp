/// \file
/// Recorded fixtures are still what the reference says, and backends conform on them and on random
/// scenes nobody chose.
#include "oracle/conform.hpp"
#include "tests/random_scene.hpp"

#include "gpu/backends.hpp"
#include "oracle/reference_backend.hpp"
#include "reference/error.hpp"
#include "tools/fixture_folder.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace decant {
namespace {

/// Every row that did not pass, in words; empty where all did.
std::string objections(Backend& backend, const Fixture& fixture) {
  std::string all;
  for (const CheckRow& row :
       judge(backend, fixture, *std::make_unique<Judgement>(prepare(fixture))))
    if (judged_verdict(row) != Verdict::pass)
      all += row.check + " " + row.field + ": score " + std::to_string(row.score) + " at " +
             std::to_string(row.worst_id) + " " + row.reason + "\n";
  return all;
}

/// A fixture of the state with the oracle's answer, as `record` makes it.
Fixture answered(Fixture fixture) {
  evaluate_oracle(fixture.scene, fixture.state, fixture.fields.emplace(),
                  fixture.condition.emplace());
  return fixture;
}

TEST(Fixtures, AreReproducedByTheReferenceOfToday) {
  const auto files = fixtures_in(fixture_folder(), false);
  EXPECT_GE(files.size(), 6u);
  for (const auto& file : files) EXPECT_NO_THROW(prepare(read_fixture(file))) << file;
}

TEST(Fixtures, AreRefusedWhereTheReferenceSaysOtherwise) {
  Fixture fixture = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-rest.h5");
  fixture.fields->density[100] *= 1 + 1e-13;
  try {
    prepare(fixture);
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(error.key(), "density[100]");
  }
}

TEST(Fixtures, AreJudgedTheSameByAllPairsAsByCells) {
  const Fixture fixture = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-splash.h5");
  const auto backend = make_reference_backend(NeighborSearch::all_pairs);
  EXPECT_EQ(objections(*backend, fixture), "");
}

class Conformance : public testing::TestWithParam<std::tuple<std::string, Executor>> {
 protected:
  std::unique_ptr<Backend> backend() {
    return make_backend(std::get<0>(GetParam()), std::get<1>(GetParam()));
  }
  void SetUp() override {
    std::string why_not;
    if (!executor_available(std::get<1>(GetParam()), &why_not)) GTEST_SKIP() << why_not;
  }
};

TEST_P(Conformance, HoldsOnEverySmallFixture) {
  const auto tested = backend();
  for (const auto& file : fixtures_in(fixture_folder(), false))
    EXPECT_EQ(objections(*tested, read_fixture(file)), "") << file;
}

TEST_P(Conformance, HoldsOnRandomScenes) {
  const auto tested = backend();
  rc::detail::checkGTest([&](std::uint32_t seed) {
    const Fixture fixture = answered(test::random_fixture(seed));
    const std::string found = objections(*tested, fixture);
    RC_LOG() << found;
    RC_ASSERT(found.empty());
  });
}

INSTANTIATE_TEST_SUITE_P(Backends, Conformance,
                         testing::Combine(testing::ValuesIn(backend_names()),
                                          testing::Values(Executor::host, Executor::cuda)),
                         [](const auto& chosen) {
                           return std::get<0>(chosen.param) +
                                  (std::get<1>(chosen.param) == Executor::host ? "Host" : "Cuda");
                         });

}  // namespace
}  // namespace decant
