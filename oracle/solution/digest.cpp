/// \file
/// SHA-256 by OpenSSL: of texts, files, and of what a fixture must find unchanged.
#include "oracle/solution/digest.hpp"
#include "reference/error.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <vector>

namespace decant {
namespace {

class Sha256 {
 public:
  Sha256() : context_(EVP_MD_CTX_new(), EVP_MD_CTX_free) {
    require(context_ && EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) == 1);
  }

  void add(const void* bytes, std::size_t size) { require(EVP_DigestUpdate(context_.get(), bytes, size) == 1); }

  /// Real numbers as fp32. Adding 0 makes −0 and 0 one value, as they are for every consumer.
  template <typename Derived>
  void add_reals(const Eigen::DenseBase<Derived>& values) {
    const Eigen::ArrayXXf single = values.derived().array().template cast<float>() + 0.0f;
    add(single.data(), static_cast<std::size_t>(single.size()) * sizeof(float));
  }

  std::string hexadecimal() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned size = 0;
    require(EVP_DigestFinal_ex(context_.get(), digest.data(), &size) == 1);
    std::string text;
    for (unsigned k = 0; k < size; ++k) text += fmt::format("{:02x}", digest[k]);
    return text;
  }

 private:
  static void require(bool done) {
    if (!done) throw std::runtime_error("OpenSSL has no SHA-256");
  }

  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
};

}  // namespace

std::string sha256_of_text(std::string_view text) {
  Sha256 sha;
  sha.add(text.data(), text.size());
  return sha.hexadecimal();
}

std::string sha256_of_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(file.string(), "file", "unreadable", "a file that can be read");
  Sha256 sha;
  std::vector<char> block(1 << 16);
  while (in.read(block.data(), static_cast<std::streamsize>(block.size())) || in.gcount() > 0)
    sha.add(block.data(), static_cast<std::size_t>(in.gcount()));
  if (in.bad()) throw InputError(file.string(), "file", "unreadable", "a file that can be read");
  return sha.hexadecimal();
}

std::string digest_of(const Fields& fields) {
  Sha256 sha;
  sha.add_reals(fields.boundary_volume);
  sha.add_reals(fields.density);
  sha.add_reals(fields.pressure);
  for (const auto* a : {&fields.acceleration, &fields.pressure_acceleration, &fields.viscous_acceleration,
                        &fields.wall_pressure_acceleration, &fields.wall_viscous_acceleration})
    sha.add_reals(*a);
  for (const auto* c : {&fields.fluid_neighbor_count, &fields.fluid_neighbor_id_sum, &fields.wall_neighbor_count,
                        &fields.wall_neighbor_id_sum})
    sha.add(c->data(), static_cast<std::size_t>(c->size()) * sizeof(std::int64_t));
  return sha.hexadecimal();
}

std::string digest_of(const Walls& walls) {
  Sha256 sha;
  for (const auto& container : walls.containers) {
    const auto count = static_cast<std::uint64_t>(container.position.cols());
    sha.add(&count, sizeof count);
    sha.add_reals(container.position);
  }
  return sha.hexadecimal();
}

}  // namespace decant
