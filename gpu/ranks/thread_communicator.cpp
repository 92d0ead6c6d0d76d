/// \file
/// Ranks that are threads of one process: each posts where its data is, waits for the others, and copies what it
/// needs from theirs.
#include "gpu/ranks/communicator.hpp"
#include "reference/error.hpp"

#include <condition_variable>
#include <mutex>

namespace decant::gpu {
namespace {

struct Board {
  explicit Board(int ranks) : posted(static_cast<std::size_t>(ranks)) {}

  std::mutex mutex;
  std::condition_variable changed;
  std::vector<const void*> posted;  // by rank
  int waiting = 0;
  int reading = 0;  // ranks that may still look at what others have posted
  unsigned round = 0;
  std::string failure;  // of the first rank that failed
};

class ThreadCommunicator : public Communicator {
 public:
  ThreadCommunicator(std::shared_ptr<Board> board, int rank) : board_(std::move(board)), rank_(rank) {}

  int rank() const override { return rank_; }
  int size() const override { return static_cast<int>(board_->posted.size()); }

  void broadcast(Bytes& data) override {
    share(&data, [&] {
      if (rank_ != 0) data = *static_cast<const Bytes*>(board_->posted[0]);
    });
  }
  std::vector<Bytes> gather(const Bytes& own) override {
    std::vector<Bytes> all;
    share(&own, [&] {
      for (const void* posted : board_->posted)
        if (rank_ == 0) all.push_back(*static_cast<const Bytes*>(posted));
    });
    return all;
  }
  void all_gather(const void* own, std::size_t bytes, void* all) override {
    share(own, [&] {
      for (std::size_t k = 0; k < board_->posted.size(); ++k)
        std::memcpy(static_cast<std::byte*>(all) + k * bytes, board_->posted[k], bytes);
    });
  }
  void exchange(std::span<const Segment> send, std::span<const Segment> receive) override {
    share(send.data(), [&] {
      for (std::size_t from = 0; from < receive.size(); ++from) {
        if (static_cast<int>(from) == rank_) continue;
        const Segment& sent = static_cast<const Segment*>(board_->posted[from])[rank_];
        if (sent.bytes != receive[from].bytes)
          throw BackendError("rank " + std::to_string(from) + " sends " + std::to_string(sent.bytes) +
                             " bytes where rank " + std::to_string(rank_) + " expects " +
                             std::to_string(receive[from].bytes));
        if (sent.bytes > 0) std::memcpy(receive[from].data, sent.data, sent.bytes);
      }
    });
  }
  void fail(const std::string& why) noexcept override {
    const std::lock_guard lock(board_->mutex);
    if (board_->failure.empty()) board_->failure = why;
    board_->changed.notify_all();
  }

 private:
  /// Nobody goes on before all have posted, and nobody's data changes before all have read.
  template <class Read>
  void share(const void* own, Read read) {
    board_->posted[static_cast<std::size_t>(rank_)] = own;
    wait_for_all();
    try {
      read();
    } catch (const std::exception& e) {
      fail(e.what());
    }
    {
      std::unique_lock lock(board_->mutex);
      if (--board_->reading == 0) board_->changed.notify_all();
      board_->changed.wait(lock, [&] { return board_->reading == 0; });
      if (!board_->failure.empty()) throw BackendError(board_->failure);
    }
  }
  void wait_for_all() {
    std::unique_lock lock(board_->mutex);
    if (!board_->failure.empty()) throw BackendError(board_->failure);
    const unsigned round = board_->round;
    if (++board_->waiting == size()) {
      board_->waiting = 0;
      board_->reading = size();
      ++board_->round;
      board_->changed.notify_all();
    }
    board_->changed.wait(lock, [&] { return board_->round != round || !board_->failure.empty(); });
    if (board_->round == round) throw BackendError(board_->failure);
  }

  std::shared_ptr<Board> board_;
  int rank_;
};

}  // namespace

std::vector<std::unique_ptr<Communicator>> thread_communicators(int ranks) {
  const auto board = std::make_shared<Board>(ranks);
  std::vector<std::unique_ptr<Communicator>> all;
  for (int k = 0; k < ranks; ++k) all.push_back(std::make_unique<ThreadCommunicator>(board, k));
  return all;
}

}  // namespace decant::gpu
