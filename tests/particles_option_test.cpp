/// \file
/// How many particles a scene can be asked for.
#include "tools/commands/particles_option.hpp"

#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/scene_file.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <string>

namespace decant {
namespace {

Scene shipped() { return load_scene(DECANT_SOURCE_DIR "/fixtures/scenes/pour-4k.json"); }

constexpr double memory = 16e9;  // bytes

InputError refusal(std::int64_t particles) {
  try {
    (void)with_asked_particles(shipped(), particles, "pour-4k.json", memory);
  } catch (const InputError& error) {
    return error;
  }
  ADD_FAILURE() << particles << " must be refused";
  return {"", "", "", ""};
}

TEST(ParticlesOption, TooFewNamesItselfAndTheFewestThatFit) {
  for (const std::int64_t few : {1, 10, 500}) {
    const InputError error = refusal(few);
    EXPECT_EQ(error.key(), "--particles");
    EXPECT_EQ(error.value(), std::to_string(few));
    ASSERT_EQ(error.bound().substr(0, 9), "at least ") << error.bound();
    const std::int64_t fewest = std::atoll(error.bound().c_str() + 9);
    EXPECT_GT(fewest, few);
    EXPECT_LT(fewest, initial_state(shipped()).size());
    const Scene fits = with_asked_particles(shipped(), fewest, "pour-4k.json");
    EXPECT_NEAR(static_cast<double>(initial_state(fits).size()), static_cast<double>(fewest),
                0.05 * static_cast<double>(fewest) + 2);
    EXPECT_EQ(refusal(fewest * 9 / 10).key(), "--particles");
  }
}

TEST(ParticlesOption, TooManyIsRefusedAtOnce) {
  const auto start = std::chrono::steady_clock::now();
  const InputError error = refusal(1'000'000'000);
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 1.0);
  EXPECT_EQ(error.key(), "--particles");
  EXPECT_NE(error.bound().find("500 GB in all, and this machine has 16 GB"), std::string::npos) << error.bound();
  EXPECT_EQ(refusal(static_cast<std::int64_t>(memory / host_bytes_per_particle) + 1).key(), "--particles");
}

TEST(ParticlesOption, KnowsHowMuchMemoryThereIs) {
  EXPECT_GT(memory_of_machine(), 1e8);
  EXPECT_LT(memory_of_machine(), 1e15);
}

TEST(ParticlesOption, OutOfRangeIsRefused) {
  EXPECT_EQ(refusal(0).key(), "--particles");
  EXPECT_EQ(refusal(-5).value(), "-5");
  EXPECT_NE(refusal(2'000'000'000).bound().find("1 … 1000000000"), std::string::npos);
}

}  // namespace
}  // namespace decant
