/* MPI calls sched_yield between two polls while it waits: see `SLEEP` in mod.rs. Most messages come within microseconds if the other
 * process runs; what takes longer waits for a processor. */
#include <stdint.h>
#include <time.h>

/* Polls this far apart, ns, belong to different waits. */
static const int64_t APART = 3000;
/* The time for which a wait polls before it sleeps, ns. */
static const int64_t POLLED = 20000;
static const struct timespec PAUSE = {0, 20000};

static int64_t now(void)
{
  struct timespec time;
  clock_gettime(CLOCK_MONOTONIC, &time);
  return time.tv_sec * 1000000000LL + time.tv_nsec;
}

int sched_yield(void)
{
  static int64_t last, begun;
  int64_t time = now();
  if (time - last > APART) begun = time;
  last = time;
  if (time - begun < POLLED) return 0;
  nanosleep(&PAUSE, 0);
  last = now();
  return 0;
}
