/// \file
/// flock(2) on the folder itself: there is no lock file to be left behind, or to be removed under
/// somebody who waits for it.
#include "tools/pour/folder_lock.hpp"

#include "reference/error.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>
#include <cerrno>
#include <stdexcept>
#include <system_error>

namespace decant::pour {

FolderLock::FolderLock(const char* option, const std::filesystem::path& folder)
    : descriptor_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (descriptor_ < 0)
    throw std::runtime_error(folder.string() + ": cannot be opened: " + std::generic_category().message(errno));
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  ::close(descriptor_);
  throw InputError("command line", option, folder.string(),
                   "another process is writing to this folder; name another one, or wait");
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace decant::pour
