/// \file
/// Lists in tiles: what a long advance leaves is complete, tiles that find no room give way to other lists, and a run
/// that is resumed keeps its bits either way.
#include "oracle/files/fixture_file.hpp"
#include "oracle/solution/force_free.hpp"
#include "tests/backend_variants.hpp"

#include "reference/sampling.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace decant {
namespace {

class Tiles : public testing::TestWithParam<Executor> {
 protected:
  void SetUp() override {
    std::string why_not;
    if (!executor_available(GetParam(), &why_not)) GTEST_SKIP() << why_not;
  }
  std::unique_ptr<Backend> loaded(const std::string& name, const Fixture& f, const ParticleState& state) const {
    auto backend = test::make_variant(name, GetParam());
    backend->load(f.scene, sample_walls(f.scene), state);
    return backend;
  }
  static Fixture fixture(const std::string& name) {
    return read_fixture(DECANT_SOURCE_DIR "/fixtures/" + name + ".h5");
  }
};

INSTANTIATE_TEST_SUITE_P(On, Tiles, testing::Values(Executor::host, Executor::cuda), test::executor_name);

/// Many lists after the one that the advance begins with, each made without a sort, around where particles are then. What
/// an advance leaves names every neighbor, and on the way none was missed: a pair that is would move its particles by more
/// than rounding does.
TEST_P(Tiles, MissNoNeighborAfterManyRebuilds) {
  for (const std::string name : {"pour-4k-splash", "pour-4k-stream"}) {
    const Fixture f = fixture(name);
    const auto tiles = loaded("list:tiles=on:skin=0.05", f, f.state), hash = loaded("hash", f, f.state);
    const auto before = tiles->neighbor_stats().rebuilds;
    ASSERT_TRUE(tiles->advance(100).ok()) << name;
    ASSERT_TRUE(hash->advance(100).ok()) << name;
    EXPECT_GT(tiles->neighbor_stats().rebuilds - before, 15) << name;
    ParticleState state, other;
    tiles->read(state);
    hash->read(other);
    EXPECT_LT((state.position - other.position).cwiseAbs().maxCoeff(), 1e-3 * f.scene.particle_spacing) << name;
    Fields listed, found;
    ASSERT_TRUE(tiles->evaluate(listed).ok());
    ASSERT_TRUE(loaded("hash", f, state)->evaluate(found).ok());
    EXPECT_TRUE(listed.fluid_neighbor_count == found.fluid_neighbor_count) << name;
    EXPECT_TRUE(listed.fluid_neighbor_id_sum == found.fluid_neighbor_id_sum) << name;
    EXPECT_TRUE(listed.wall_neighbor_count == found.wall_neighbor_count) << name;
    EXPECT_TRUE(listed.wall_neighbor_id_sum == found.wall_neighbor_id_sum) << name;
  }
}

/// Memory tells whether they are in use.
TEST_P(Tiles, ServeSmallScenesWhateverTheirParticlesWeigh) {
  for (const std::string name : {"pour-4k-stream", "hostile-fast-wall", "hostile-impact"}) {
    Fixture f = fixture(name);
    for (const bool forces : {true, false}) {
      if (!forces) f.scene = force_free(f.scene);  // as contact is checked
      const auto bytes = [&](const std::string& choice) {
        return loaded(choice, f, f.state)->neighbor_stats().device_bytes;
      };
      EXPECT_NE(bytes("list:tiles=on:skin=0.2"), bytes("list:tiles=off:skin=0.2:threads_per_particle=8"))
          << name << " " << forces;
    }
  }
}

TEST_P(Tiles, AreMadeOfTheStateAlone) {
  const Fixture f = fixture("pour-4k-splash");
  const auto whole = loaded("list:tiles=on", f, f.state);
  ASSERT_TRUE(whole->advance(40).ok());
  ParticleState half, end, resumed;
  whole->read(half);
  ASSERT_TRUE(whole->advance(40).ok());
  whole->read(end);
  const auto rest = loaded("list:tiles=on", f, half);
  ASSERT_TRUE(rest->advance(40).ok());
  rest->read(resumed);
  EXPECT_TRUE(end.position == resumed.position);
  EXPECT_TRUE(end.velocity == resumed.velocity);
}

/// Each of the crowd is a neighbor of all others, more than the lists of a tile can name.
TEST_P(Tiles, GiveWayWhereTheyFindNoRoom) {
  Fixture f = fixture("hostile-crowd");
  f.scene.fluid.sound_speed = 1e-3;  // so that it stays together
  f.scene.fluid.viscosity = f.scene.fluid.wall_viscosity = 0;
  const Vec3 middle = f.state.position.rowwise().mean();
  const double H = f.scene.support_radius();
  constexpr int side = 14;
  f.state.position.resize(3, side * side * side);
  f.state.velocity = Eigen::Matrix3Xd::Zero(3, f.state.position.cols());
  for (int k = 0; k < f.state.position.cols(); ++k)
    f.state.position.col(k) =
        (middle + 0.03 * H * Vec3(k % side, k / side % side, k / side / side)).cast<float>().cast<double>();
  const auto run = [&](const std::string& name, const ParticleState& from, int substeps) {
    const auto backend = loaded(name, f, from);
    const Status status = backend->advance(substeps);
    EXPECT_TRUE(status.ok()) << name << ": " << describe(status);
    ParticleState to;
    backend->read(to);
    return to;
  };
  const std::string same = GetParam() == Executor::cuda ? ":threads_per_particle=8" : "";
  const ParticleState without = run("list:skin=0.4:launch=graph" + same, f.state, 3);
  const ParticleState with = run("list:tiles=on:skin=0.4", f.state, 3);
  EXPECT_TRUE(without.position == with.position);
  const auto whole = loaded("list:tiles=on", f, f.state);
  ASSERT_TRUE(whole->advance(2).ok());
  ASSERT_TRUE(whole->advance(2).ok());
  ParticleState end;
  whole->read(end);
  const ParticleState half = run("list:tiles=on", f.state, 2), resumed = run("list:tiles=on", half, 2);
  EXPECT_TRUE(end.position == resumed.position);
  EXPECT_TRUE(end.velocity == resumed.velocity);
}

}  // namespace
}  // namespace decant
