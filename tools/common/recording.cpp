/// \file
/// The oracle at work on a state to be written.
#include "tools/common/recording.hpp"

#include "oracle/checks/conform.hpp"
#include "reference/error.hpp"
#include "reference/sampling.hpp"
#include "tools/common/build_provenance.hpp"

namespace decant {

std::string record_answer(Fixture& fixture, std::int64_t ensemble_substeps, std::int64_t ensemble_members) {
  fixture.state.quantise();
  std::string ill_posed_reason =
      evaluate_oracle(fixture.scene, fixture.state, fixture.fields.emplace(), fixture.condition.emplace());
  fixture.ensemble =
      run_ensemble(fixture.scene, sample_walls(fixture.scene), fixture.state, ensemble_substeps, ensemble_members);
  return ill_posed_reason;
}

std::map<std::string, std::string> recording_provenance(const BackendInfo& info, const std::string& started_from) {
  auto provenance = build_provenance();
  provenance.insert({
      {"started_from", started_from},
      {"advanced_by", info.name},
      {"advanced_options", info.options},
      {"advanced_executor", info.executor},
      {"advanced_device", info.device},
      {"advanced_precision", info.precision},
  });
  return provenance;
}

Fixture with_kernel(Fixture fixture, KernelFamily kernel) {
  if (fixture.scene.kernel == kernel) return fixture;
  fixture.scene.kernel = kernel;
  const std::string recorded = fixture.name;
  fixture.name += std::string("-") + to_string(kernel);
  fixture.sample_id.resize(0);
  const std::string why = record_answer(fixture, fixture.ensemble.substeps, fixture.ensemble.members);
  if (!why.empty()) throw InputError("command line", "--kernel", to_string(kernel), recorded + ": " + why);
  return fixture;
}

}  // namespace decant
