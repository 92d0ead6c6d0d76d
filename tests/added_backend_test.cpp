/// \file
/// The backend of gpu/ADD_A_BACKEND.md is judged like those of the table.
#include "gpu/solver/device_solver.hpp"

namespace decant::gpu::host {
std::unique_ptr<DeviceSolver> make_slab(const SolverOptions& options);
}

#include "oracle/files/fixture_file.hpp"
#include "tests/slab_neighbors.cu"

#include "gpu/backends.hpp"
#include "oracle/checks/conform.hpp"

#include <gtest/gtest.h>

namespace decant {
namespace {

TEST(AddedBackend, IsJudgedLikeTheOthers) {
  const auto backend = backend_around("slab", Executor::host, "", gpu::host::make_slab({}));
  EXPECT_EQ(backend->info().name, "slab");
  for (const char* name : {"hostile-crowd", "hostile-periodic", "hostile-cell-faces"}) {
    const Fixture fixture = read_fixture(std::string(DECANT_SOURCE_DIR "/fixtures/") + name + ".h5");
    int rows = 0;
    for (const CheckRow& row : run_checks(*backend, fixture, prepare_reference(fixture))) {
      EXPECT_EQ(verdict_of(row), Verdict::pass) << name << ": " << row.check << " " << row.field;
      ++rows;
    }
    EXPECT_GT(rows, 30) << name;
  }
}

}  // namespace
}  // namespace decant
