"""A campaign on Slurm: workers are jobs of one GPU each, started by dask-jobqueue; needs dask-jobqueue and distributed.

    python slurm_campaign.py FOLDER        on a login node; the same again goes on with what lacks
    python slurm_campaign.py --job-script  prints the script that each job is

Queue, GPUs, time and the lines that find the command are the site's: change JOB.
"""

import sys

from dask_jobqueue import SLURMCluster

import decant

JOB = {
    "queue": "gpu",
    "cores": 1,  # blocks at a time in a job
    "job_cpu": 8,  # for a block's threads
    "processes": 1,
    "memory": "16GB",
    "walltime": "02:00:00",
    "job_extra_directives": ["--gpus-per-task=1", "--requeue"],
    "job_script_prologue": ["module load cuda", "source ~/decant/bin/activate"],
    # A worker ends before its job does, so that a block in work goes elsewhere in order.
    "worker_extra_args": ["--lifetime", "110m", "--lifetime-stagger", "5m"],
}


def cluster(jobs, **more):
    """A Dask cluster that keeps so many jobs in the queue. Jobs that end are replaced."""
    made = SLURMCluster(**JOB, **more)
    made.adapt(minimum_jobs=jobs, maximum_jobs=jobs)
    return made


def main():
    if sys.argv[1:] == ["--job-script"]:
        print(SLURMCluster(**JOB).job_script())
        return
    with cluster(jobs=32) as jobs:
        decant.campaign.fuzz(
            backend="hash", executor="cuda", cases=1_000_000, block=2000, threads=8, folder=sys.argv[1], cluster=jobs
        ).require()


if __name__ == "__main__":
    main()
