/// \file
/// Options of backends: each value by its name, by the name it had in version 0.1, and what is refused.
#include "gpu/options.hpp"

#include "reference/error.hpp"

#include <gtest/gtest.h>

namespace decant::gpu {
namespace {

TEST(BackendOptions, AreTakenByTheirEarlierNamesToo) {
  const struct {
    const char *backend, *now, *before;
  } pairs[] = {
      {"hash", "wall_cells=off", "grid=fluid"},
      {"hash", "moving_walls=rebuilt", "source=rebuilt"},
      {"hash", "force_neighbors=recomputed", "pairs=rescan"},
      {"hash", "threads_per_particle=4:launch=stream", "lanes=4:launch=plain"},
      {"list", "criterion=relative:check_completeness=on", "trigger=local:verify=on"},
      {"list", "launch=graph:threads-per-particle=1", "launch=graphs:lanes=1"},
  };
  for (const auto& [backend, now, before] : pairs) {
    EXPECT_TRUE(parse_options(backend, now) == parse_options(backend, before)) << now;
    EXPECT_FALSE(parse_options(backend, now) == SolverOptions()) << now;
  }
  const SolverOptions defaults =
      parse_options("hash", "wall_cells=on:moving_walls=body_frame:force_neighbors=cached:sort=counting:launch=auto");
  EXPECT_TRUE(defaults == SolverOptions());
}

TEST(BackendOptions, AreRefusedByKeyValueAndBound) {
  for (const char* wrong :
       {"wall_cells=maybe", "wall_cells=on:grid=all", "threads_per_particle=3", "skin=0.1", "colour=red", "capacity=0",
        "launch", "ranks=0", "ranks=65", "halo_margin=0", "ranks=2:threads_per_particle=2"})
    EXPECT_THROW(parse_options("hash", wrong), InputError) << wrong;
  try {
    (void)parse_options("list", "criterion=global-local");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("displacement or relative"), std::string::npos) << error.what();
  }
}

/// Help, flags and parser are of one table: each value it names is taken.
TEST(BackendOptions, TakeEveryValueThatTheirHelpNames) {
  for (const OptionDescription& option : option_descriptions()) {
    std::string backend = option.backends;
    backend = backend.substr(0, backend.find(' '));
    std::string values = option.values;
    for (std::size_t at = 0; at < values.size();) {
      const std::size_t end = std::min(values.find(", ", at), values.size());
      std::string value = values.substr(at, end - at);
      at = end + 2;
      if (value == "N") value = "7";
      if (value == "a share of H") value = "0.2";
      EXPECT_NO_THROW(parse_options(backend, std::string(option.key) + "=" + value)) << option.key << '=' << value;
    }
    EXPECT_GT(std::string(option.help).size(), 10) << option.key;
  }
}

}  // namespace
}  // namespace decant::gpu
