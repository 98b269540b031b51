"""What a study is: its design, its rules for the number of missions, the shipped ones."""
