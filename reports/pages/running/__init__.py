"""What runs for a page: missions that it needs beside results, and its notebook."""
