// Which instruction set runs, and on how many threads.
#pragma once

#include <string>
#include <thread>
#include <vector>

#include "kernels.hpp"

namespace kinverse {

// the instruction sets this processor has, narrowest first
std::vector<const Kernels*> available_kernels();
const Kernels& active_kernels();
void set_active_kernels(const std::string& name);

int thread_count();
void set_thread_count(int count);

// work(first, last, part) on contiguous parts of [0, count); part numbers the parts in order
template <class Work>
void split_over_threads(long count, long least_part, Work work) {
  long parts = thread_count();
  if (parts > count / least_part) parts = count / least_part;
  if (parts <= 1) {
    work(0L, count, 0L);
    return;
  }
  std::vector<std::thread> threads;
  for (long part = 1; part < parts; ++part)
    threads.emplace_back(work, count * part / parts, count * (part + 1) / parts, part);
  work(0L, count / parts, 0L);
  for (auto& thread : threads) thread.join();
}

}  // namespace kinverse
