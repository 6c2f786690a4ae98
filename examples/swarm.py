"""What a swarm reaches in 2,000 evaluations, and what a descent from its members makes of it."""

import numpy as np

import kinverse as kv


def main():
    robot = kv.load("puma560")
    T = robot.fk(robot.random(50, rng=12345))
    print("method  median objective, 2,000 evals  solved with polish  polishes, mean")
    for name in ("pso", "gwo", "bees", "de"):
        s = kv.Swarm(optimizer=name).fit(robot).solve(T, rng=1)
        cost, starts = np.median(s.stats.cost), s.stats.starts.mean()
        print(f"{name:7} {cost:29.3f}  {100 * s.ok.mean():17.0f} %  {starts:14.2f}")


if __name__ == "__main__":
    main()
