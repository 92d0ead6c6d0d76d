// The sums over pairs on a GPU, from neighbor lists that are rebuilt every rebuild=N substeps with skin=S (a share of
// H); walls, contact and integration as in all_pairs.hpp and as_plugin.hpp. From the project's folder:
//   nvcc -std=c++20 -O3 -arch=sm_90 -Xcompiler -fPIC -shared -I. -I/usr/include/eigen3 -o cuda_lists.so
//     oracle/plugin/examples/cuda_lists.cu
#define EIGEN_NO_CUDA
#include "oracle/plugin/examples/all_pairs.hpp"
#include "oracle/plugin/examples/as_plugin.hpp"
#include "oracle/plugin/examples/cuda_lists.cuh"

#include <thrust/device_vector.h>
#include <thrust/extrema.h>
#include <thrust/host_vector.h>

#include <cstdlib>
#include <stdexcept>

template <class T>
using Device = thrust::device_vector<T>;
auto* raw(auto& values) { return thrust::raw_pointer_cast(values.data()); }

/// Lists of one kind of neighbors: those of particle i begin at i × capacity.
struct Lists {
  int capacity = 64;
  Device<int> count, entries;
  std::vector<std::int64_t> offsets;  // for who asks
  std::vector<std::int32_t> ids;

  void give(const std::int64_t*& offsets_out, const std::int32_t*& ids_out) {
    const thrust::host_vector<int> counts = count, all = entries;
    offsets.assign(1, 0), ids.clear();
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const auto first = all.begin() + static_cast<std::ptrdiff_t>(i) * capacity;
      ids.insert(ids.end(), first, first + counts[i]);
      offsets.push_back(static_cast<std::int64_t>(ids.size()));
    }
    offsets_out = offsets.data(), ids_out = ids.data();
  }
};

struct CudaLists : AllPairs {
  static constexpr std::uint32_t offers = 0x7FF;
  int every = 1;
  float skin = 0;
  std::int64_t start = 0, built = -1;
  Constants c{};
  Device<float3> x_, v_, wall_x_, wall_v_;
  Device<float> volume_;
  Device<float2> rho_p_;
  Device<Sums> sums_;
  Lists fluid_, walls_;
  cudaDeviceProp device{};

  bool option(const std::string& key, const std::string& value) {
    if (key == "rebuild") every = std::atoi(value.c_str());
    else if (key == "skin") skin = std::strtof(value.c_str(), nullptr);
    else return false;
    return every > 0 && skin >= 0;
  }
  const char* device_name() { return cudaGetDeviceProperties(&device, 0) == 0 ? device.name : "no CUDA device"; }
  void loaded() {
    start = substep, built = -1;
    c = {s.kernel,
         H,
         h,
         m,
         static_cast<float>(s.rest_density),
         static_cast<float>(s.viscosity),
         static_cast<float>(s.wall_viscosity),
         {}};
    for (int a = 0; a < 3; ++a) c.period[a] = s.periodic[a] ? period(a) : 0;
    volume_ = volume, fluid_.count.clear(), walls_.count.clear();
  }

  int n() const { return static_cast<int>(x.size()); }
  int blocks() const { return (n() + 127) / 128; }
  static void put(const std::vector<Vec>& from, Device<float3>& to) {
    static_assert(sizeof(Vec) == sizeof(float3));
    to.resize(from.size());
    if (!from.empty()) thrust::copy_n(reinterpret_cast<const float3*>(from.data()), from.size(), to.begin());
  }
  static void check() {
    if (const auto error = cudaGetLastError(); error != 0) throw std::runtime_error(cudaGetErrorString(error));
  }

  void build_lists(Lists& lists, Device<float3>& targets, bool own) {
    for (bool fits = false; !fits;) {
      lists.count.resize(x.size()), lists.entries.resize(x.size() * static_cast<std::size_t>(lists.capacity));
      build<<<blocks(), 128>>>(c, (1 + skin) * H, lists.capacity, n(), raw(x_), static_cast<int>(targets.size()),
                               raw(targets), own, raw(lists.count), raw(lists.entries));
      check();
      const int most = *thrust::max_element(lists.count.begin(), lists.count.end());
      fits = most <= lists.capacity;
      if (!fits) lists.capacity = most + most / 4;
    }
  }
  void build_where_due() {
    if (n() == 0 || built == substep || (substep - start) % every != 0) return;
    built = substep;
    build_lists(fluid_, x_, true);
    build_lists(walls_, wall_x_, false);
  }

  void find_densities() {
    place_walls();
    put(x, x_), put(v, v_), put(wall_x, wall_x_), put(wall_v, wall_v_);
    build_where_due();
    resize_fields();
    if (n() == 0) return;
    sums_.resize(x.size());
    sum_densities<<<blocks(), 128>>>(c, fluid_.capacity, walls_.capacity, n(), raw(x_), raw(wall_x_), raw(volume_),
                                     raw(fluid_.count), raw(fluid_.entries), raw(walls_.count), raw(walls_.entries),
                                     raw(sums_));
    check();
    const thrust::host_vector<Sums> sums = sums_;
    for (std::size_t i = 0; i < x.size(); ++i) {
      density[i] = sums[i].density, pressure[i] = pressure_at(density[i]);
      fluid_count[i] = sums[i].fluid_count, fluid_sum[i] = sums[i].fluid_sum;
      wall_count[i] = sums[i].wall_count, wall_sum[i] = sums[i].wall_sum;
    }
  }
  void find_forces() {
    parts.assign(x.size(), {});
    if (n() == 0) return;
    thrust::host_vector<float2> rho_p(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) rho_p[i] = make_float2(density[i], pressure[i]);
    rho_p_ = rho_p;
    sum_forces<<<blocks(), 128>>>(c, fluid_.capacity, walls_.capacity, n(), raw(x_), raw(v_), raw(wall_x_),
                                  raw(wall_v_), raw(volume_), raw(rho_p_), raw(fluid_.count), raw(fluid_.entries),
                                  raw(walls_.count), raw(walls_.entries), raw(sums_));
    check();
    const thrust::host_vector<Sums> sums = sums_;
    const auto vec = [](float3 a) { return Vec(a.x, a.y, a.z); };
    for (std::size_t i = 0; i < x.size(); ++i)
      parts[i] = {vec(sums[i].pressure), vec(sums[i].viscous), vec(sums[i].wall_pressure), vec(sums[i].wall_viscous)};
  }

  void lists(decant_lists& out) {
    place_walls();
    put(x, x_), put(wall_x, wall_x_);
    build_where_due();
    out.built = n() > 0 ? built : substep;
    fluid_.give(out.fluid_offsets, out.fluid), walls_.give(out.wall_offsets, out.wall);
  }
};

const decant_plugin_table* decant_plugin(std::uint32_t) {
  static const decant_plugin_table table = PluginOf<CudaLists>::table("cuda-lists");
  return &table;
}
