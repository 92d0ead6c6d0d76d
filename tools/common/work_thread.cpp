/// \file
/// The queue and the thread that empties it.
#include "tools/common/work_thread.hpp"

#include <utility>

namespace decant {

WorkThread::WorkThread(std::size_t capacity) : capacity_(capacity), thread_([this] { run(); }) {}

WorkThread::~WorkThread() {
  {
    std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void WorkThread::push(std::function<void()> work) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return waiting_.size() + (busy_ ? 1 : 0) < capacity_ || failure_; });
  if (failure_) std::rethrow_exception(failure_);
  waiting_.push_back(std::move(work));
  changed_.notify_all();
}

void WorkThread::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return (waiting_.empty() && !busy_) || failure_; });
  if (failure_) std::rethrow_exception(failure_);
}

void WorkThread::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
    if (stop_) return;
    std::function<void()> work = std::move(waiting_.front());
    waiting_.pop_front();
    busy_ = true;
    lock.unlock();
    std::exception_ptr failure;
    try {
      work();
    } catch (...) {
      failure = std::current_exception();
    }
    work = nullptr;  // and with it what it holds
    lock.lock();
    busy_ = false;
    failure_ = failure;
    changed_.notify_all();
    // A frame is missing from here on; writing later ones would hide it.
    if (failure_) return;
  }
}

}  // namespace decant
