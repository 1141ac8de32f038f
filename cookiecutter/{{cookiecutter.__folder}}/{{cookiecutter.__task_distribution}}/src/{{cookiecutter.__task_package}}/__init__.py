{% if cookiecutter.what == "pair" %}
"""{{ partial("summary", kinds="task")[:1].upper() ~ partial("summary", kinds="task")[1:] }}."""
{% endif %}
