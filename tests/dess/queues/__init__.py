"""The queues of the simulator beside those that theory knows."""
