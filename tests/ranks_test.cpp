/// \file
/// Backends on ranks: the same bits of `hash` on any number of them, whatever the margin of the ghosts; particles
/// that change ranks; ranks without particles; and what a rank's failure does to the others.
#include "gpu/ranks/communicator.hpp"
#include "gpu/ranks/partition.hpp"
#include "oracle/files/fixture_file.hpp"
#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/sampling.hpp"
#include "reference/scene_checks.hpp"
#include "tests/backend_variants.hpp"
#include "tests/falling_points.hpp"
#include "tests/random_scene.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <atomic>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

namespace decant {
namespace {

struct Result {
  Status status;
  ParticleState state;
  Fields fields;
  RankStats ranks;
};

/// `parts` advances of `substeps`, and the fields at the end; after an advance that tells of trouble neither.
Result attempt(const std::string& variant, const Scene& scene, const ParticleState& start, int parts, int substeps,
               Executor executor = Executor::host) {
  const Walls walls = sample_walls(scene);
  const auto backend = test::make_variant(variant, executor);
  backend->load(scene, walls, start);
  Result result;
  for (int part = 0; part < parts && result.status.ok(); ++part) result.status = backend->advance(substeps);
  if (!result.status.ok()) return result;
  result.fields = Fields::unwritten(start.size(), walls.size());
  EXPECT_TRUE(backend->evaluate(result.fields).ok());
  backend->read(result.state);
  result.ranks = backend->neighbor_stats().ranks;
  return result;
}
/// The same where nothing goes wrong.
Result run(const std::string& variant, const Scene& scene, const ParticleState& start, int parts, int substeps,
           Executor executor = Executor::host) {
  const Result result = attempt(variant, scene, start, parts, substeps, executor);
  EXPECT_TRUE(result.status.ok()) << variant << ": " << describe(result.status);
  return result;
}

template <class Matrix>
bool same_bits(const Matrix& a, const Matrix& b) {
  return a.size() == b.size() &&
         std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof(*a.data())) == 0;
}

void expect_same_bits(const Result& a, const Result& b, const std::string& what) {
  EXPECT_EQ(describe(a.status), describe(b.status)) << what;
  if (!a.status.ok()) return;
  EXPECT_TRUE(same_bits(a.state.position, b.state.position)) << what;
  EXPECT_TRUE(same_bits(a.state.velocity, b.state.velocity)) << what;
  EXPECT_TRUE(same_bits(a.fields.density, b.fields.density)) << what;
  EXPECT_TRUE(same_bits(a.fields.pressure, b.fields.pressure)) << what;
  EXPECT_TRUE(same_bits(a.fields.acceleration, b.fields.acceleration)) << what;
  EXPECT_TRUE(same_bits(a.fields.viscous_acceleration, b.fields.viscous_acceleration)) << what;
  EXPECT_TRUE(same_bits(a.fields.wall_pressure_acceleration, b.fields.wall_pressure_acceleration)) << what;
  EXPECT_TRUE(same_bits(a.fields.fluid_neighbor_id_sum, b.fields.fluid_neighbor_id_sum)) << what;
  EXPECT_TRUE(same_bits(a.fields.wall_neighbor_id_sum, b.fields.wall_neighbor_id_sum)) << what;
}

class OnRanks : public testing::TestWithParam<std::tuple<const char*, Executor>> {
 protected:
  void SetUp() override {
    std::string why_not;
    if (!executor_available(executor(), &why_not)) GTEST_SKIP() << why_not;
  }
  Executor executor() const { return std::get<Executor>(GetParam()); }
  Fixture fixture() const {
    return read_fixture(std::string(DECANT_SOURCE_DIR "/fixtures/") + std::get<0>(GetParam()) + ".h5");
  }
};

TEST_P(OnRanks, TheHashHasTheSameBits) {
  const Fixture f = fixture();
  for (const char* way : {"", ":force_neighbors=recomputed"}) {
    const std::string hash = std::string("hash:threads_per_particle=1") + way;
    const Result one = run(hash, f.scene, f.state, 2, 14, executor());
    for (const char* options : {":ranks=2", ":ranks=3:halo_margin=3:sort=thrust", ":ranks=4:halo_margin=0.02"})
      expect_same_bits(one, run(hash + options, f.scene, f.state, 2, 14, executor()), hash + options);
  }
}

TEST_P(OnRanks, ListsMissNoPair) {
  const Fixture f = fixture();
  for (const char* options : {"ranks=3:capacity=4", "ranks=2:criterion=relative", "ranks=4:halo_margin=0.05"}) {
    const std::string variant = std::string("list:check_completeness=on:") + options;
    const auto backend = test::make_variant(variant, executor());
    backend->load(f.scene, sample_walls(f.scene), f.state);
    EXPECT_TRUE(backend->advance(20).ok()) << variant;
    const PairTotals pairs = backend->neighbor_stats().verified;
    EXPECT_GT(pairs.pairs, 0) << variant;
    EXPECT_EQ(pairs.missed + pairs.wall_missed, 0) << variant;
  }
}

INSTANTIATE_TEST_SUITE_P(Fixtures, OnRanks,
                         testing::Combine(testing::Values("pour-4k-stream", "hostile-periodic-box", "hostile-crowd",
                                                          "hostile-outliers", "hostile-cell-faces", "motion-drum"),
                                          testing::Values(Executor::host, Executor::cuda)),
                         [](const auto& p) { return test::plain_name(std::get<0>(p.param), std::get<1>(p.param)); });

TEST(Ranks, RandomScenesHaveTheSameBits) {
  EXPECT_TRUE(rc::check([] {
    const Fixture f = test::random_fixture(*rc::gen::arbitrary<std::uint32_t>());
    const int ranks = *rc::gen::inRange(2, 7);
    const double margin = *rc::gen::element(0.02, 0.3, 1.0);
    // A crowd may burst out of the domain: then that is what all have to say.
    const Result one = attempt("hash", f.scene, f.state, 1, 12);
    RC_CLASSIFY(one.status.ok(), "inside");
    const std::string variant = "hash:ranks=" + std::to_string(ranks) + ":halo_margin=" + std::to_string(margin);
    expect_same_bits(one, attempt(variant, f.scene, f.state, 1, 12), variant);
  }));
}

TEST(Ranks, MoreRanksThanParticles) {
  for (const char* name : {"hostile-one-particle", "hostile-empty"}) {
    const Fixture f = read_fixture(std::string(DECANT_SOURCE_DIR "/fixtures/") + name + ".h5");
    for (const char* variant : {"hash:ranks=5", "list:ranks=5"})
      expect_same_bits(run("hash", f.scene, f.state, 3, 7), run(variant, f.scene, f.state, 3, 7), variant);
  }
}

TEST(Ranks, BoxesFollowTheFluid) {
  // A block that falls into a cup and spreads: whoever had the upper half has little to do later.
  Scene scene = test::falling_points_scene();
  scene.particle_spacing = 0.006;
  scene.schedule.substeps_per_frame = substeps_for(scene);
  const ParticleState start = initial_state(scene);
  const Result one = run("hash", scene, start, 20, 60), three = run("hash:ranks=3", scene, start, 20, 60);
  expect_same_bits(one, three, "hash:ranks=3");
  EXPECT_GT(three.ranks.migrations, 20);
  EXPECT_GT(three.ranks.ghosts, 0);
  EXPECT_LE(three.ranks.largest_imbalance, 1.15);
  EXPECT_GE(three.ranks.rebalances, 20);
  EXPECT_EQ(one.ranks.migrations, 0);
}

TEST(Ranks, OptionsThatWouldChangeTheOrderOfSumsAreRefused) {
  EXPECT_THROW(test::make_variant("hash:ranks=2:threads_per_particle=4", Executor::host), InputError);
  EXPECT_THROW(test::make_variant("hash:ranks=65", Executor::host), InputError);
  EXPECT_THROW(test::make_variant("hash:ranks=0", Executor::host), InputError);
  EXPECT_THROW(test::make_variant("brute:ranks=2", Executor::host), InputError);
  EXPECT_THROW(test::make_variant("list:ranks=2:halo_margin=0.01", Executor::host), InputError);
}

/// Runs body(communicator) on so many threads.
template <class Body>
void on_threads(int ranks, Body body) {
  auto communicators = gpu::thread_communicators(ranks);
  std::vector<std::thread> threads;
  for (auto& communicator : communicators) threads.emplace_back([&] { body(*communicator); });
  for (auto& thread : threads) thread.join();
}

TEST(Communicator, MovesWhatItIsGiven) {
  on_threads(4, [](gpu::Communicator& ranks) {
    const int own = ranks.rank(), others = ranks.size();
    for (int round = 0; round < 50; ++round) {
      EXPECT_EQ(ranks.all(own), (std::vector<int>{0, 1, 2, 3}));
      EXPECT_TRUE(ranks.any(own == round % others));
      EXPECT_FALSE(ranks.any(false));
      gpu::Bytes data(own == 0 ? 1000 : 0, std::byte{static_cast<unsigned char>(round)});
      ranks.broadcast(data);
      EXPECT_EQ(data, gpu::Bytes(1000, std::byte{static_cast<unsigned char>(round)}));
      const auto gathered = ranks.gather(gpu::Bytes(static_cast<std::size_t>(own), std::byte{7}));
      EXPECT_EQ(gathered.size(), own == 0 ? 4u : 0u);
      for (std::size_t k = 0; k < gathered.size(); ++k) EXPECT_EQ(gathered[k].size(), k);
      // 10 × sender + receiver, so many times as the receiver is told.
      std::vector<std::vector<int>> out, in;
      std::vector<gpu::Segment> send, receive;
      for (int r = 0; r < others; ++r) {
        out.emplace_back(r == own ? 0 : r + own + 1, 10 * own + r);
        in.emplace_back(r == own ? 0 : r + own + 1, -1);
      }
      for (auto& v : out) send.push_back({v.data(), v.size() * sizeof(int)});
      for (auto& v : in) receive.push_back({v.data(), v.size() * sizeof(int)});
      ranks.exchange(send, receive);
      for (int r = 0; r < others; ++r)
        for (const int value : in[static_cast<std::size_t>(r)]) EXPECT_EQ(value, 10 * r + own);
    }
  });
}

TEST(Communicator, AFailureReachesAllWhoWait) {
  std::atomic<int> told = 0;
  on_threads(3, [&](gpu::Communicator& ranks) {
    if (ranks.rank() == 1) return ranks.fail("rank 1: out of memory");
    for (int call = 0; call < 2; ++call)  // and whoever asks again
      try {
        ranks.any(true);
        ADD_FAILURE() << "went on without rank 1";
      } catch (const BackendError& e) {
        EXPECT_STREQ(e.what(), "rank 1: out of memory");
        ++told;
      }
  });
  EXPECT_EQ(told, 4);
}

TEST(Communicator, AMessageThatIsCutIsRefused) {
  std::atomic<int> told = 0;
  on_threads(2, [&](gpu::Communicator& ranks) {
    int value[4] = {};
    std::vector<gpu::Segment> send(2), receive(2);
    const std::size_t other = ranks.rank() == 0;
    send[other] = {value, ranks.rank() == 0 ? 12u : 16u};
    receive[other] = {value, 16};
    try {
      ranks.exchange(send, receive);
    } catch (const BackendError& e) {
      EXPECT_STREQ(e.what(), "rank 0 sends 12 bytes where rank 1 expects 16");
      ++told;
    }
  });
  EXPECT_EQ(told, 2);
}

TEST(Partition, SharesTheWorkAndCoversSpace) {
  EXPECT_TRUE(rc::check([] {
    const int ranks = *rc::gen::inRange(1, 17);
    std::mt19937 random(*rc::gen::arbitrary<std::uint32_t>());
    std::vector<gpu::WorkSample> samples;
    for (int k = 0; k < 4000; ++k) {
      const auto real = [&] { return std::uniform_real_distribution<float>(0, 1)(random); };
      samples.push_back({{real(), 3 * real() * real(), real()}, 0.5f + real()});
    }
    const std::vector<gpu::Box> boxes = gpu::bisect(samples, ranks);
    RC_ASSERT(boxes.size() == static_cast<std::size_t>(ranks));
    std::vector<double> work(boxes.size());
    for (const gpu::WorkSample& s : samples) {
      int owners = 0;
      for (std::size_t r = 0; r < boxes.size(); ++r) {
        const auto& [low, high] = boxes[r];
        const gpu::Float3 x = s.position;
        if (x.x < low.x || x.x >= high.x || x.y < low.y || x.y >= high.y || x.z < low.z || x.z >= high.z) continue;
        ++owners;
        work[r] += s.work;
      }
      RC_ASSERT(owners == 1);
    }
    RC_ASSERT(gpu::imbalance(work) < 1.03);
  }));
}

TEST(Partition, CopesWithNothingAndWithOnePlace) {
  constexpr float nothing = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(gpu::bisect({}, 6).size(), 6u);
  EXPECT_EQ(gpu::bisect({{{nothing, 0, 0}, 1}, {{0, 0, 0}, 0}}, 3).size(), 3u);
  EXPECT_EQ(gpu::bisect(std::vector<gpu::WorkSample>(100, {{1, 2, 3}, 1}), 4).size(), 4u);
  EXPECT_EQ(gpu::imbalance({}), 1);
  EXPECT_EQ(gpu::imbalance({0, 0}), 1);
  EXPECT_EQ(gpu::imbalance({3, 1}), 1.5);
}

}  // namespace
}  // namespace decant
