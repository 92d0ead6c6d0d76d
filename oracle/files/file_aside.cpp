/// \file
/// System calls, because streams do not tell why they failed.
#include "oracle/files/file_aside.hpp"

#include <fmt/format.h>

#include <fcntl.h>
#include <unistd.h>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <random>
#include <stdexcept>
#include <utility>

namespace decant {
namespace {

/// A name that no other thread, process or machine uses; whether it is free says who opens it.
std::filesystem::path name_beside(const std::filesystem::path& file) {
  static std::atomic<int> counter{0};
  return file.parent_path() / fmt::format(".{}.{}-{}-{:08x}.tmp", file.filename().string(), ::getpid(),
                                          counter.fetch_add(1), std::random_device()());
}

}  // namespace

FileAside::FileAside(std::filesystem::path file) : file_(std::move(file)) {
  if (file_.filename().empty() || std::filesystem::is_directory(file_))
    throw std::runtime_error(file_.string() + ": is a folder, a file is to be written");
  do {
    aside_ = name_beside(file_);
    descriptor_ = ::open(aside_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  } while (descriptor_ < 0 && errno == EEXIST);
  if (descriptor_ < 0) fail(std::strerror(errno));
}

FileAside::~FileAside() {
  if (descriptor_ >= 0) ::close(descriptor_);
  std::error_code ignored;
  if (!aside_.empty()) std::filesystem::remove(aside_, ignored);
}

void FileAside::fail(const char* why) const {
  throw std::runtime_error(fmt::format("{}: cannot be written: {}", file_.string(), why));
}

void FileAside::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail(std::strerror(errno));
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

void FileAside::commit() {
  if (::fsync(descriptor_) != 0 || ::close(std::exchange(descriptor_, -1)) != 0) fail(std::strerror(errno));
  std::error_code error;
  std::filesystem::rename(aside_, file_, error);
  if (error) fail(error.message().c_str());
  aside_.clear();
  // The file is whole either way, and some file systems refuse to sync a folder.
  const auto folder = file_.parent_path();
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

void write_text_file(const std::filesystem::path& file, std::string_view text) {
  FileAside out(file);
  out.write(text);
  out.commit();
}

}  // namespace decant
