/// \file
/// The check `status` sees every report that is not made, or made wrongly.
#include "oracle/checks/status_check.hpp"
#include "oracle/checks/conform.hpp"
#include "oracle/solution/reference_backend.hpp"
#include "tests/random_scene.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace decant {
namespace {

/// The reference, whose reports are edited on the way.
class Reporter : public Backend {
 public:
  using Edit = std::function<Status(const Status&, const ParticleState&, const Scene&)>;
  explicit Reporter(Edit edit) : edit_(std::move(edit)) {}

  BackendInfo info() const override { return inner_->info(); }
  void load(const Scene& scene, const Walls& walls, const ParticleState& state) override {
    scene_ = scene;
    inner_->load(scene, walls, state);
  }
  Status evaluate(Fields& out, const StageInputs* given) override { return edited(inner_->evaluate(out, given)); }
  Status advance(int substeps) override { return edited(inner_->advance(substeps)); }
  void read(ParticleState& out) const override { inner_->read(out); }
  StageTimes stage_times() const override { return {}; }
  NeighborStats neighbor_stats() const override { return {}; }

 private:
  Status edited(const Status& status) const {
    ParticleState state;
    inner_->read(state);
    return edit_(status, state, scene_);
  }
  Edit edit_;
  Scene scene_;
  std::unique_ptr<Backend> inner_ = make_reference_backend();
};

/// Fields of the rows that fail.
std::set<std::string> failing(const Scene& scene, Reporter::Edit edit) {
  Reporter backend(std::move(edit));
  RowBuilder builder(backend.info(), "status");
  check_status(backend, scene, 17, builder);
  std::set<std::string> fields;
  for (const CheckRow& row : builder.take())
    if (verdict_of(row) != Verdict::pass) fields.insert(row.field);
  return fields;
}

using Names = std::set<std::string>;

TEST(StatusCheck, PassesTheReferenceInEveryDomain) {
  for (std::uint32_t seed = 1; seed < 40; ++seed)
    EXPECT_EQ(failing(test::random_fixture(seed).scene,
                      [](const Status& s, const ParticleState&, const Scene&) { return s; }),
              Names{})
        << seed;
}

TEST(StatusCheck, SeesEachFaceThatIsNotWatched) {
  Scene scene = test::random_fixture(1).scene;
  scene.domain = {Vec3(-1, -2, -3), Vec3(2, 1, 4), {}};
  for (int axis = 0; axis < 3; ++axis)
    for (const bool upper : {false, true})
      EXPECT_EQ(failing(scene,
                        [&](const Status& s, const ParticleState& state, const Scene& its) {
                          if (!(s.bits & Status::escaped)) return s;
                          const double x = state.position(axis, s.particle);
                          return (upper ? x > its.domain.max[axis] : x < its.domain.min[axis]) ? Status{} : s;
                        }),
                Names{"escaped"});
}

TEST(StatusCheck, SeesInfinitiesThatAreNotReported) {
  const Scene scene = test::random_fixture(1).scene;
  EXPECT_EQ(failing(scene,
                    [](const Status& s, const ParticleState& state, const Scene&) {
                      if (!(s.bits & Status::non_finite)) return s;
                      return std::isinf(state.velocity.col(s.particle).sum()) ? Status{} : s;
                    }),
            Names{"velocity"});
}

TEST(StatusCheck, SeesAnotherParticleAnotherSubstepAndAlarmsForNothing) {
  const Scene scene = test::random_fixture(1).scene;
  const Names all_reports{"escaped", "position", "velocity"};
  EXPECT_EQ(failing(scene,
                    [](Status s, const ParticleState&, const Scene&) {
                      s.particle += s.bits != 0;
                      return s;
                    }),
            all_reports);
  EXPECT_EQ(failing(scene,
                    [](Status s, const ParticleState&, const Scene&) {
                      s.substep += s.bits != 0;
                      return s;
                    }),
            all_reports);
  EXPECT_EQ(failing(scene,
                    [](Status s, const ParticleState&, const Scene&) {
                      if (s.ok()) s = {Status::missed_pair, 0, 0};
                      return s;
                    }),
            Names{"none"});
}

}  // namespace
}  // namespace decant
