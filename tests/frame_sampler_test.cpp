/// \file
/// What a pour does beside its solver: the thread for it, and the sampler of frames.
#include "tools/pour/frame_sampler.hpp"

#include "reference/initial_state.hpp"
#include "tests/falling_points.hpp"
#include "tools/common/work_thread.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

namespace decant {
namespace {

using test::FallingPoints;

TEST(WorkThread, DoesEveryPieceInOrder) {
  std::vector<int> done;
  WorkThread thread;
  for (int k = 0; k < 100; ++k) thread.push([&done, k] { done.push_back(k); });
  thread.drain();
  ASSERT_EQ(done.size(), 100u);
  for (int k = 0; k < 100; ++k) EXPECT_EQ(done[static_cast<std::size_t>(k)], k);
}

TEST(WorkThread, TakesAPieceWhenTheOneBeforeIsDone) {
  std::atomic<int> done = 0;
  WorkThread thread;
  for (int k = 0; k < 20; ++k) {
    thread.push([&done] {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      ++done;
    });
    EXPECT_GE(done, k);
  }
}

TEST(WorkThread, HandsOnAFailureAndDoesNothingAfterIt) {
  std::atomic<int> calls = 0;
  const auto fail = [&] {
    ++calls;
    throw std::runtime_error("the disk is full");
  };
  WorkThread thread;
  thread.push(fail);
  EXPECT_THROW(thread.drain(), std::runtime_error);
  EXPECT_THROW(thread.push(fail), std::runtime_error);
  EXPECT_EQ(calls, 1);
}

TEST(FrameSampler, WorksWhileTheSolverDoesAndIsOneFrameBehindAtMost) {
  const Scene scene = test::falling_points_scene(3);
  const auto state = std::make_shared<const ParticleState>(initial_state(scene));
  const frames::Layout layout = frames::layout_of(scene, state->size());
  FallingPoints backend;
  backend.load(scene, {}, *state);
  Fields fields = Fields::unwritten(state->size(), 0);
  ASSERT_TRUE(backend.evaluate(fields, nullptr).ok());
  std::promise<void> solver_goes_on;
  std::atomic<std::int64_t> written = 0, told = 0;
  pour::FrameSampler samples(scene, layout,
                             {[&](const frames::Frame& frame) {
                                if (frame.index == 0) solver_goes_on.get_future().wait();
                                if (frame.index == 2) throw std::runtime_error("the disk is full");
                              },
                              [&](const frames::Frame&) { ++written; }, [&](const pour::TimelineRow&) { ++told; }});
  samples.end_of_frame(state, fields, {0, 0.0, 0.0});
  EXPECT_EQ(written, 0);
  solver_goes_on.set_value();
  samples.end_of_frame(state, fields, {1, 0.0, 0.0});
  EXPECT_GE(written, 1);
  samples.drain();
  EXPECT_EQ(written, 2);
  samples.end_of_frame(state, fields, {2, 0.0, 0.0});
  EXPECT_THROW(samples.drain(), std::runtime_error);
  EXPECT_THROW(samples.end_of_frame(state, fields, {3, 0.0, 0.0}), std::runtime_error);
  EXPECT_EQ(told, 2);
  EXPECT_EQ(samples.rows().size(), 2u);
}

TEST(FrameSampler, GivesFieldsInWhichNothingIsWritten) {
  const Scene scene = test::falling_points_scene(3);
  const auto state = std::make_shared<const ParticleState>(initial_state(scene));
  const frames::Layout layout = frames::layout_of(scene, state->size());
  pour::FrameSampler samples(
      scene, layout, {[](const frames::Frame&) {}, [](const frames::Frame&) {}, [](const pour::TimelineRow&) {}});
  const Eigen::Index n = state->size();
  for (std::int64_t frame = 0; frame < 3; ++frame) {
    Fields fields = samples.unwritten(n, 11);
    ASSERT_EQ(fields.boundary_volume.size(), 11);
    ASSERT_EQ(fields.acceleration.cols(), n);
    ASSERT_TRUE(fields.density.array().isNaN().all() && fields.wall_viscous_acceleration.array().isNaN().all());
    ASSERT_TRUE((fields.wall_neighbor_count.array() == -1).all());
    fields.density.setConstant(1000);
    fields.pressure.setZero();
    samples.end_of_frame(state, std::move(fields), {frame, 0.0, 0.0});
    samples.drain();
  }
  EXPECT_EQ(samples.unwritten(3, 2).density.size(), 3);
}

}  // namespace
}  // namespace decant
