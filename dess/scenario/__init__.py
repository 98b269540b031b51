"""What a mission is about.

The scenario and its fields, data sheets, generated seas, and the files of nodes and maps.
"""
