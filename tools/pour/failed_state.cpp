/// \file
/// A failed state as a fixture.
#include "tools/pour/failed_state.hpp"

#include "oracle/checks/conform.hpp"
#include "oracle/files/fixture_file.hpp"
#include "oracle/solution/fixture.hpp"
#include "reference/sampling.hpp"
#include "tools/common/build_provenance.hpp"

#include <fmt/format.h>

namespace decant::pour {
namespace {

// Particles; a larger state is dumped with a sample of the oracle's fields.
constexpr Eigen::Index largest_whole_dump = 16384;

}  // namespace

std::string save_failed_state(const std::filesystem::path& file, const Scene& scene, const ParticleState& good,
                              const BackendInfo& backend, const std::string& trouble) {
  try {
    Fixture fixture;
    fixture.name = "failed-state";
    fixture.phase = "failed";
    fixture.scene = scene;
    fixture.state = good;
    fixture.state.quantise();
    evaluate_oracle(scene, fixture.state, fixture.fields.emplace(), fixture.condition.emplace());
    // A short one: whoever runs this state again looks at what comes next.
    fixture.ensemble = run_ensemble(scene, sample_walls(scene), fixture.state, 4, 4);
    if (good.size() > largest_whole_dump) reduce_to_sample(fixture);
    fixture.provenance = build_provenance();
    fixture.provenance.insert({{"trouble", trouble},
                               {"backend", backend.name},
                               {"options", backend.options},
                               {"executor", backend.executor},
                               {"device", backend.device}});
    write_fixture(file, fixture);
    return fmt::format("; the last good state, substep {}, is in {}", good.substep, file.string());
  } catch (const std::exception& error) {
    return fmt::format("; its state could not be saved: {}", error.what());
  }
}

}  // namespace decant::pour
